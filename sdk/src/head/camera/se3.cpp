#include "head/camera/se3.h"

#include <algorithm>

namespace maq::head {

namespace {

double sine_ratio(double angle) { return angle > 0 ? std::sin(angle) / angle : 1; }

// (1 - cos) / angle^2, without the difference.
double cosine_ratio(double angle) {
  const double half = sine_ratio(angle / 2);
  return half * half / 2;
}

}  // namespace

Mat3 exp_rotation(Vec3 w) {
  const double angle = length(w);
  const Mat3 cross = cross_matrix(w);
  return kIdentity3 + sine_ratio(angle) * cross + cosine_ratio(angle) * (cross * cross);
}

Vec3 log_rotation(const Mat3& r) {
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

}  // namespace maq::head
