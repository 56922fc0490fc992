// Votes of the pixels near an edge for its position: its distance away, down the gradient of the field.
#pragma once

#include <vector>

#include "edges/curves/edge_curves.h"

namespace maq {

// Planes of the frame's size. Votes are spread over their four pixels and smoothed; the direction across the edge is
// kept as its double angle, so that the two sides of a crease agree.
struct RidgeVotes {
  int width = 0, height = 0;
  std::vector<float> weight;      // votes: 1 on an edge with one visible side, 2 with both
  std::vector<float> cos2, sin2;  // weight * double angle of the direction across the edge
  std::vector<float> scratch;     // a row each of the smoothing

  void gather(const EdgeField& field, CurveCounts& counts);
};

}  // namespace maq
