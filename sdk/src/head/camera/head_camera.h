// The camera of an image of a head.
#pragma once

#include "core/math/rotation.h"

namespace maq::head {

using maq::exp_rotation;
using maq::kIdentity3;
using maq::log_rotation;
using maq::Mat3;

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

// x right, y down, z forward; pixel = focal_px * (x, y) / z + (cx_px, cy_px), the centre of the first pixel is (0, 0).
struct HeadCamera {
  RigidMotion head_to_camera;  // decimetres
  double focal_px = 0, cx_px = 0, cy_px = 0;
  int width_px = 0, height_px = 0;  // of the image; 0 if it does not matter
};

}  // namespace maq::head
