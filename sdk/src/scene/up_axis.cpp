#include "scene/up_axis.h"

#include <cmath>

namespace maq {

std::array<double, 3> up_of_cameras(const std::vector<std::array<double, 9>>& rotations) {
  if (rotations.empty()) return {0, 0, 1};
  std::array<double, 3> sum{};
  for (const auto& rotation : rotations) {
    // The second row is where down in the picture is in the world.
    for (size_t i = 0; i < 3; ++i) sum[i] -= rotation[3 + i];
  }
  const double length = std::sqrt(sum[0] * sum[0] + sum[1] * sum[1] + sum[2] * sum[2]);
  constexpr double kFaintest = 0.05;  // of what it would be if all were the same
  if (length < kFaintest * double(rotations.size())) {
    const auto& first = rotations[0];
    return {-first[3], -first[4], -first[5]};
  }
  return {sum[0] / length, sum[1] / length, sum[2] / length};
}

std::array<double, 3> up_by_convention(const std::array<double, 3>& convention,
                                       const std::vector<std::array<double, 9>>& rotations) {
  if (rotations.empty()) return convention;
  const auto up = up_of_cameras(rotations);
  const double cosine = up[0] * convention[0] + up[1] * convention[1] + up[2] * convention[2];
  return cosine < std::sqrt(0.5) ? up : convention;
}

}  // namespace maq
