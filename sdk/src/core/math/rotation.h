// Rotations in space and their exponential map, float64. Accurate at any angle, 0 and pi included (T. Barfoot, State
// Estimation for Robotics, chapter 7).
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "core/math/vec3.h"

namespace maq {

struct Mat3 : std::array<double, 9> {};  // row by row

inline constexpr Mat3 kIdentity3 = {1, 0, 0, 0, 1, 0, 0, 0, 1};

inline Vec3 operator*(const Mat3& m, Vec3 p) {
  return {m[0] * p.x + m[1] * p.y + m[2] * p.z, m[3] * p.x + m[4] * p.y + m[5] * p.z,
          m[6] * p.x + m[7] * p.y + m[8] * p.z};
}

inline Mat3 operator*(const Mat3& a, const Mat3& b) {
  Mat3 product;
  for (size_t i = 0; i < 9; i += 3) {
    for (size_t j = 0; j < 3; ++j) product[i + j] = a[i] * b[j] + a[i + 1] * b[3 + j] + a[i + 2] * b[6 + j];
  }
  return product;
}

inline Mat3 operator*(double s, Mat3 m) {
  for (double& value : m) value *= s;
  return m;
}

inline Mat3 operator+(Mat3 a, const Mat3& b) {
  for (size_t i = 0; i < 9; ++i) a[i] += b[i];
  return a;
}

inline Mat3 transposed(const Mat3& m) { return {m[0], m[3], m[6], m[1], m[4], m[7], m[2], m[5], m[8]}; }

// The matrix W with W p = w x p.
inline Mat3 cross_matrix(Vec3 w) { return {0, -w.z, w.y, w.z, 0, -w.x, -w.y, w.x, 0}; }

// sin(angle) / angle.
inline double sine_ratio(double angle) { return angle > 0 ? std::sin(angle) / angle : 1; }

// (1 - cos) / angle^2, without the difference.
inline double cosine_ratio(double angle) {
  const double half = sine_ratio(angle / 2);
  return half * half / 2;
}

// Rodrigues' formula: the rotation by |w| radians about w.
inline Mat3 exp_rotation(Vec3 w) {
  const double angle = length(w);
  const Mat3 cross = cross_matrix(w);
  return kIdentity3 + sine_ratio(angle) * cross + cosine_ratio(angle) * (cross * cross);
}

// The shortest w with exp_rotation(w) = r, |w| <= pi; at pi either sign.
inline Vec3 log_rotation(const Mat3& r) {
  // The quaternion by its largest part (Shepperd 1978): no other way keeps its digits near 0 and near pi.
  const double trace = r[0] + r[4] + r[8];
  const double four[4] = {1 + trace, 1 + 2 * r[0] - trace, 1 + 2 * r[4] - trace, 1 + 2 * r[8] - trace};
  const double xy = r[1] + r[3], xz = r[2] + r[6], yz = r[5] + r[7];
  const Vec3 skew = {r[7] - r[5], r[2] - r[6], r[3] - r[1]};
  double real = 0;
  Vec3 q;
  switch (std::max_element(four, four + 4) - four) {
    case 0: real = four[0], q = skew; break;
    case 1: real = skew.x, q = {four[1], xy, xz}; break;
    case 2: real = skew.y, q = {xy, four[2], yz}; break;
    default: real = skew.z, q = {xz, yz, four[3]}; break;
  }
  if (real < 0) real = -real, q = -q;
  const double size = length(q);
  return size > 0 ? (2 * std::atan2(size, real) / size) * q : Vec3{};
}

// The left Jacobian of exp_rotation(): a small change d of w turns by this matrix times d, after the rotation.
inline Mat3 left_jacobian(Vec3 w) {
  const double angle = length(w), square = angle * angle;
  const Mat3 cross = cross_matrix(w);
  // (angle - sin) / angle^3 by its series where the difference loses digits.
  const double third =
      angle > 0.05 ? (1 - sine_ratio(angle)) / square : 1.0 / 6 - square / 120 + square * square / 5040;
  return kIdentity3 + cosine_ratio(angle) * cross + third * (cross * cross);
}

}  // namespace maq
