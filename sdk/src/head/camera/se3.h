// Rigid motions, and the exponential map of rotations, float64. Accurate at any angle, 0 and pi included (T. Barfoot,
// State Estimation for Robotics, chapter 7).
#pragma once

#include <array>
#include <cmath>

#include "core/math/vec3.h"

namespace maq::head {

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

// p_camera = rotation p_head + translation, or any other such pair of frames.
struct RigidMotion {
  Mat3 rotation = kIdentity3;
  Vec3 translation;
};

inline Vec3 operator*(const RigidMotion& m, Vec3 p) { return m.rotation * p + m.translation; }

// First b, then a.
inline RigidMotion operator*(const RigidMotion& a, const RigidMotion& b) {
  return {a.rotation * b.rotation, a * b.translation};
}

inline RigidMotion inverse(const RigidMotion& m) {
  const Mat3 back = transposed(m.rotation);
  return {back, -(back * m.translation)};
}

// Rodrigues' formula: the rotation by |w| radians about w.
Mat3 exp_rotation(Vec3 w);

// The shortest w with exp_rotation(w) = r, |w| <= pi; at pi either sign.
Vec3 log_rotation(const Mat3& r);

}  // namespace maq::head
