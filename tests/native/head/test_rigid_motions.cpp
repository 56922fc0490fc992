// Rotations and rigid motions: exponential map and derivatives, at angles from 0 to pi.
#include <gtest/gtest.h>

#include <cmath>

#include "head/camera/head_camera.h"

namespace {

using maq::Vec3;
using maq::head::Mat3;

constexpr double kHalfTurn = 3.141592653589793;
const double kAngles[] = {0, 1e-300, 1e-160, 1e-12, 1e-8, 1e-4, 0.1, 0.999, 1.001, 2, 3.1, kHalfTurn - 1e-7, kHalfTurn};
const Vec3 kAxis = maq::normalized({0.3, -0.5, 0.8});

// The exponential series, in long double: exp(w) = (exp(w / 2^k))^(2^k).
Mat3 exp_by_series(Vec3 w) {
  long double m[9], sum[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1}, power[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  const Mat3 cross = maq::cross_matrix(w);
  for (int i = 0; i < 9; ++i) m[i] = cross[size_t(i)];
  for (int k = 1; k < 40; ++k) {
    long double next[9] = {};
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        for (int l = 0; l < 3; ++l) next[3 * i + j] += power[3 * i + l] * m[3 * l + j] / k;
      }
    }
    for (int i = 0; i < 9; ++i) sum[i] += power[i] = next[i];
  }
  Mat3 r;
  for (int i = 0; i < 9; ++i) r[size_t(i)] = double(sum[i]);
  return r;
}

TEST(RigidMotions, TheExponentialMapIsItsSeriesAtEveryAngle) {
  for (const double angle : kAngles) {
    const Mat3 r = maq::head::exp_rotation(angle * kAxis), reference = exp_by_series(angle * kAxis);
    for (size_t i = 0; i < 9; ++i) EXPECT_NEAR(r[i], reference[i], 1e-15) << angle;
    // The difference from the identity is accurate too.
    if (angle > 0 && angle < 0.1) {
      EXPECT_NEAR(r[7] / (angle * kAxis.x), 1, 2 * angle) << angle;
    }
  }
}

TEST(RigidMotions, TheLogarithmFindsTheRotationVectorNearZeroAndNearPi) {
  for (const double angle : kAngles) {
    for (const Vec3 axis : {kAxis, Vec3{1, 0, 0}, Vec3{0, 1, 0}, Vec3{0, 0, -1}}) {
      const Vec3 w = angle * axis, found = maq::head::log_rotation(maq::head::exp_rotation(w));
      const bool is_half_turn = angle == kHalfTurn;
      const double off = std::min(maq::length(found - w), is_half_turn ? maq::length(found + w) : INFINITY);
      EXPECT_LE(off, 2e-15 * std::max(angle, 1e-300)) << angle;
    }
  }
}

TEST(RigidMotions, AMotionAndItsInverseCompose) {
  using maq::head::exp_rotation;
  const maq::head::RigidMotion a{exp_rotation({0.3, 2, -1}), {1, 2, 3}}, b{exp_rotation({1, 0, -2}), {0, -4, 2}};
  const Vec3 p = {0.5, -0.25, 3};
  EXPECT_LT(maq::length((a * b) * p - a * (b * p)), 1e-14);
  EXPECT_LT(maq::length(maq::head::inverse(a) * (a * p) - p), 1e-14);
}

}  // namespace
