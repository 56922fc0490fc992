#include "scene/capture/scene_up.h"

#include <cmath>

namespace maq {
namespace {

using Vector3 = std::array<double, 3>;

double dot(const Vector3& a, const Vector3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

Vector3 cross(const Vector3& a, const Vector3& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

}  // namespace

std::array<double, 3> up_of_cameras(const std::vector<std::array<double, 9>>& rotations) {
  if (rotations.empty()) return {0, 0, 1};
  Vector3 mean{};
  // The rows of a symmetric matrix: sum of x x^T, where x is the first row, the direction to the right in the image.
  std::array<Vector3, 3> across{};
  for (const auto& rotation : rotations) {
    for (size_t i = 0; i < 3; ++i) {
      mean[i] -= rotation[3 + i];  // the second row is where down in the image is in the world
      for (size_t j = 0; j < 3; ++j) across[i][j] += rotation[i] * rotation[j];
    }
  }
  constexpr double kFaintest = 0.05;  // of its value if all were the same
  if (std::sqrt(dot(mean, mean)) < kFaintest * double(rotations.size())) {
    const auto& first = rotations[0];
    return {-first[3], -first[4], -first[5]};
  }
  // Keeps the mean where x has no information, and is far below the information of x for cameras ten degrees apart.
  constexpr double kLevelling = 0.002;
  for (size_t i = 0; i < 3; ++i) across[i][i] += kLevelling * double(rotations.size());
  // The inverse of a symmetric matrix with rows a, b, c has rows b x c, c x a, a x b, over its determinant, which only
  // changes the length here: the matrix is positive definite.
  const auto& [a, b, c] = across;
  Vector3 up = {dot(cross(b, c), mean), dot(cross(c, a), mean), dot(cross(a, b), mean)};
  const double length = std::sqrt(dot(up, up));
  return {up[0] / length, up[1] / length, up[2] / length};
}

std::array<double, 3> up_by_convention(const std::array<double, 3>& convention,
                                       const std::vector<std::array<double, 9>>& rotations) {
  if (rotations.empty()) return convention;
  const auto up = up_of_cameras(rotations);
  const double cosine = up[0] * convention[0] + up[1] * convention[1] + up[2] * convention[2];
  return cosine < std::sqrt(0.5) ? up : convention;
}

}  // namespace maq
