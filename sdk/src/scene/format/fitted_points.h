// What is left of a cloud after all photos were looked at: the points that some photo saw, and how they look.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "scene/build/descriptor_regression.h"

namespace maq {

struct ModelledPoints {
  std::array<double, 3> origin = {0, 0, 0};  // of the places, in the world
  std::array<double, 3> up = {0, 0, 1};
  std::array<float, 3> background = {0, 0, 0};  // red, green, blue of what has no points, 0..1
  std::vector<float> x, y, z;
  std::vector<float> means;   // [count][kFeatures]: beta0; the first three are red, green, blue in 0..1
  std::vector<float> slopes;  // [count][kBasis][kFeatures]: beta
  std::vector<float>
      variations;               // [count]: how far the look moves from its mean over the photos that saw the point, RMS
  std::vector<uint32_t> views;  // [count]: photos that saw the point, at least 1
  uint64_t never_seen = 0;      // points that were dropped
  uint64_t singular = 0;        // looks kept constant since their system could not be solved

  size_t count() const { return x.size(); }
};

}  // namespace maq
