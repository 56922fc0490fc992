// Boxes: length, width and height from lines that meet at right angles.
#pragma once

#include <array>
#include <vector>

#include "edges/curves/edge_curves.h"

namespace maq {

struct MeasuredBox {
  Vec3 centre;
  std::array<Vec3, 3> axis;            // directions of length 1, at right angles
  std::array<double, 3> size_m;        // along each axis, the longest first
  std::array<double, 3> plus_minus_m;  // two standard deviations, as far as the fits tell
  int corners = 0;                     // that were seen of it, 4 to 7
};

class BoxFinder {
 public:
  // Corners in which lines meet within `tolerance_deg` of right angles start a box; lines that are connected to it and
  // run along its axes belong to it. A box is told where each of its three sides has a line between two corners.
  // `found` is overwritten: the largest volume first. Lines that bound more than one box belong to the first.
  void find(const EdgeField& field, const EdgeCurves& curves, std::vector<MeasuredBox>& found,
            double tolerance_deg = 8);

 private:
  struct Side {
    int curve, axis;
  };
  bool begin(const EdgeCurves& curves, int corner, double tolerance, std::array<Vec3, 3>& axes);
  void collect(const EdgeCurves& curves, int corner, double tolerance, const std::array<Vec3, 3>& axes);
  bool measure(const EdgeField& field, const EdgeCurves& curves, MeasuredBox& box) const;

  std::vector<Side> sides_;
  std::vector<int> to_visit_;
  std::vector<char> is_taken_, is_visited_;  // curves that are of a box; corners
};

}  // namespace maq
