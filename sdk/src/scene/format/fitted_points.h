// The points of a cloud that some photo saw, after their descriptors are fitted.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "scene/descriptor.h"

namespace maq {

struct FittedPoints {
  std::array<double, 3> origin = {0, 0, 0};  // of the positions, in the world
  std::array<double, 3> up = {0, 0, 1};
  std::array<float, 3> background = {0, 0, 0};  // red, green, blue of pixels without points, 0..1
  std::vector<float> x, y, z;
  std::vector<float> constant_terms;   // [count][kFeatures]: beta0
  std::vector<float> linear_terms;     // [count][kBasis][kFeatures]: beta
  std::vector<float> view_dependence;  // [count]: RMS change of the descriptor over the photos that saw the point
  std::vector<uint32_t> views;         // [count]: photos that saw the point, at least 1
  uint64_t never_seen = 0;             // points that were dropped
  uint64_t singular = 0;               // points kept constant since their system could not be solved

  size_t count() const { return x.size(); }
};

}  // namespace maq
