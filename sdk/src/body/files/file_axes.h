// The axes of files: metres, x to the person's left, y up, z to the front, as in glTF. Their world is the camera's,
// with y up and z towards who looks.
#pragma once

#include <array>
#include <cmath>

#include "core/math/rotation.h"

namespace maq::body {

// Body axes (x left, y back, z up) to file axes.
inline constexpr Mat3 kBodyToFile = {1, 0, 0, 0, 0, 1, 0, -1, 0};
// Camera axes (x right, y down, z forward) to the world of a file.
inline constexpr Mat3 kCameraToFile = {1, 0, 0, 0, -1, 0, 0, 0, -1};

// A rotation relative to the parent, in file axes.
inline Mat3 local_in_file(const Mat3& local) { return kBodyToFile * local * transposed(kBodyToFile); }

// The orientation of the first joint in the world of a file.
inline Mat3 orientation_in_file(const Mat3& orientation) {
  return kCameraToFile * orientation * transposed(kBodyToFile);
}

using Quaternion = std::array<double, 4>;  // x, y, z, w

inline Quaternion quaternion_of(const Mat3& rotation) {
  const Vec3 w = log_rotation(rotation);
  const double angle = length(w), fraction = sine_ratio(angle / 2) / 2;
  return {fraction * w.x, fraction * w.y, fraction * w.z, std::cos(angle / 2)};
}

// The one of the two quaternions of the same rotation that is nearer to the one before.
inline Quaternion continued(const Quaternion& before, const Quaternion& next) {
  double product = 0;
  for (size_t i = 0; i < 4; ++i) product += before[i] * next[i];
  return product >= 0 ? next : Quaternion{-next[0], -next[1], -next[2], -next[3]};
}

}  // namespace maq::body
