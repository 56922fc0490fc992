#include "app/fly_camera.h"

#include <algorithm>
#include <cmath>

namespace maquette {
namespace {

using Vec3 = std::array<double, 3>;
using Rows = std::array<Vec3, 3>;
enum { kWidth, kHeight, kFx, kFy, kOffsetX, kOffsetY };  // of Pose::lens
constexpr double kDegree = 3.14159265358979323846 / 180;

Vec3 vec3(const double* a) { return {a[0], a[1], a[2]}; }
double dot(const Vec3& a, const Vec3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
// Not by the hypot of three numbers, which loses NaN in libstdc++ 12.
double length(const Vec3& a) { return std::hypot(std::hypot(a[0], a[1]), a[2]); }
bool is_finite(const Vec3& a) { return std::isfinite(length(a)); }
Vec3 mix(double s, const Vec3& a, double t, const Vec3& b) {
  return {s * a[0] + t * b[0], s * a[1] + t * b[1], s * a[2] + t * b[2]};
}
Vec3 unit(const Vec3& a) { return mix(1 / length(a), a, 0, a); }
Vec3 cross(const Vec3& a, const Vec3& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
Rows rotation_of(const Vec3& right, const Vec3& forward) {
  const Vec3 ahead = unit(forward), aside = unit(mix(1, right, -dot(right, ahead), ahead));
  return {aside, cross(ahead, aside), ahead};
}
// About an axis of length 1 (Rodrigues' formula).
Rows rotated(const Rows& rows, const Vec3& axis, double angle) {
  const auto rotate = [&](const Vec3& row) {
    const Vec3 along = mix(dot(row, axis), axis, 0, axis), across = mix(1, row, -1, along);
    return mix(1, along, 1, mix(std::cos(angle), across, std::sin(angle), cross(axis, row)));
  };
  return rotation_of(rotate(rows[0]), rotate(rows[2]));
}
// On the shortest arc between two rotations.
Rows between(const Rows& from, const Rows& to, double fraction) {
  Vec3 sines{}, longest{};  // at 180 degrees the sine is 0; rows and what becomes of them then add up along the axis
  double cosines = -1;
  for (size_t i = 0; i < 3; ++i) {
    const Vec3 sum = mix(1, from[i], 1, to[i]);
    sines = mix(1, sines, 1, cross(from[i], to[i])), cosines += dot(from[i], to[i]);
    if (length(sum) > length(longest)) longest = sum;
  }
  return rotated(from, unit(length(sines) > 1e-6 ? sines : longest), fraction * std::atan2(length(sines), cosines));
}

}  // namespace

FlyCamera::FlyCamera(const maq_scene_info& scene, const std::vector<maq_pinhole_camera>& photos)
    : up_(unit(vec3(scene.up))) {
  if (!is_finite(up_)) up_ = {0, 0, 1};
  Vec3 middle = mix(0.5, vec3(scene.bounds_min), 0.5, vec3(scene.bounds_max));
  if (!is_finite(middle)) middle = {};
  // A box without a size, or with one that is lost in 16 digits so far out, gets one in which one can move.
  const double diagonal = length(mix(1, vec3(scene.bounds_max), -1, vec3(scene.bounds_min))), far_out = length(middle);
  size_ = diagonal > 1e-10 * far_out && std::isfinite(diagonal) ? diagonal : std::max(1.0, 1e-6 * far_out);
  // From a little above, 60 degrees wide: the ball about the box fills the image.
  const Vec3 right = unit(cross(up_, std::abs(up_[0]) < 0.9 ? Vec3{1, 0, 0} : Vec3{0, 1, 0}));
  const Vec3 ahead = unit(mix(2, cross(up_, right), -1, up_));
  pose_ = {rotation_of(right, ahead), mix(1, middle, -size_, ahead), {640, 480, 415, 415, 0, 0}};
  if (!photos.empty()) fly_to(photos[photos.size() / 2], 0, int(photos.size() / 2));
}

std::optional<FlyCamera::Pose> FlyCamera::pose_of(const maq_pinhole_camera& camera) {
  const double w = camera.intrinsics.width_px, h = camera.intrinsics.height_px, fx = camera.intrinsics.fx_px,
               fy = camera.intrinsics.fy_px;
  const Rows given{vec3(camera.rotation), vec3(camera.rotation + 3), vec3(camera.rotation + 6)};
  Pose pose{rotation_of(given[0], given[2]), vec3(camera.centre), {w, h, fx, fy}};
  pose.lens[kOffsetX] = camera.intrinsics.cx_px - (w - 1) / 2,
  pose.lens[kOffsetY] = camera.intrinsics.cy_px - (h - 1) / 2;
  double off = 0;  // cameras' rotations may be off by 0.001
  for (size_t row = 0; row < 3; ++row) off += length(mix(1, pose.rows[row], -1, given[row]));
  for (const double number : pose.lens) off += std::isfinite(number) ? 0 : 1;
  if (!(off < 0.02 && w > 0 && h > 0 && fx > 0 && fy > 0 && is_finite(pose.centre))) return {};
  if (off < 1e-10) pose.rows = given;
  return pose;
}

void FlyCamera::move(double right, double up, double forward, double seconds, double speed) {
  const auto way = [&](double fraction) { return std::clamp(fraction, -1.0, 1.0) * seconds * speed * size_; };
  const Vec3 level = mix(way(right), pose_.rows[0], way(forward), pose_.rows[2]);
  const Vec3 centre = mix(1, pose_.centre, 1, mix(1, level, way(up), up_));
  if (!is_finite(centre) || centre == pose_.centre) return;
  leave();
  pose_.centre = centre;
}

void FlyCamera::rotate(double yaw, double pitch) {
  if (!std::isfinite(yaw) || !std::isfinite(pitch) || (yaw == 0 && pitch == 0)) return;
  leave();
  Rows rows = rotated(pose_.rows, up_, -yaw);
  // To the right, if it were level; straight up or down every roll is.
  const Vec3 across = cross(rows[2], up_);
  const Vec3 level = unit(length(across) > 0.01 ? across : mix(1, rows[0], -dot(rows[0], up_), up_));
  const double steep = std::atan2(dot(rows[2], up_), length(across));
  rows = rotated(rows, level, std::clamp(steep + pitch, -89 * kDegree, 89 * kDegree) - steep);
  const double roll = std::atan2(dot(rows[0], cross(rows[2], level)), dot(rows[0], level));
  pose_.rows = rotated(rows, rows[2], roll * std::expm1(-std::abs(yaw) - std::abs(pitch)));
}

void FlyCamera::zoom(double factor) {
  if (!std::isfinite(factor) || factor <= 0 || factor == 1) return;
  leave();
  double &fx = pose_.lens[kFx], half_px = std::max(pose_.lens[kWidth], pose_.lens[kHeight]) / 2;
  const double scale = std::clamp(fx * factor, half_px / std::tan(55 * kDegree), half_px / std::tan(10 * kDegree)) / fx;
  fx *= scale, pose_.lens[kFy] *= scale;
}

void FlyCamera::fly_to(const maq_pinhole_camera& camera, double seconds, int photo_index) {
  const std::optional<Pose> to = pose_of(camera);
  if (!to || !std::isfinite(seconds)) return;
  leave();
  from_ = pose_, to_ = *to, target_ = camera, photo_index_ = photo_index, flight_s_ = seconds, flown_s_ = 0;
  if (seconds <= 0) update(0);
}

bool FlyCamera::update(double seconds) {
  if (!target_ || !(seconds >= 0)) return false;
  flown_s_ += seconds;
  if (flown_s_ >= flight_s_) {
    pose_ = to_, at_ = target_;
    target_.reset();
    return true;
  }
  const double t = flown_s_ / flight_s_, fraction = t * t * (3 - 2 * t);
  pose_.rows = between(from_.rows, to_.rows, fraction);
  pose_.centre = mix(1 - fraction, from_.centre, fraction, to_.centre);
  for (size_t i = 0; i < 6; ++i) pose_.lens[i] = (1 - fraction) * from_.lens[i] + fraction * to_.lens[i];
  return true;
}

maq_pinhole_camera FlyCamera::camera(int width_px, int height_px) const {
  const std::array<double, 6>& lens = pose_.lens;
  const double scale = std::min(width_px / lens[kWidth], height_px / lens[kHeight]);
  maq_pinhole_camera camera{};
  camera.struct_size = sizeof camera;
  camera.intrinsics = {width_px, height_px, lens[kFx] * scale, lens[kFy] * scale, 0, 0, {}};
  camera.intrinsics.cx_px = (width_px - 1) / 2.0 + lens[kOffsetX] * scale;
  camera.intrinsics.cy_px = (height_px - 1) / 2.0 + lens[kOffsetY] * scale;
  for (size_t i = 0; i < 9; ++i) camera.rotation[i] = pose_.rows[i / 3][i % 3];
  std::copy(pose_.centre.begin(), pose_.centre.end(), camera.centre);
  return camera;
}

int FlyCamera::nearest_photo(const std::vector<maq_pinhole_camera>& photos) const {
  int nearest = -1;
  double smallest = HUGE_VAL;
  for (size_t i = 0; i < photos.size(); ++i) {
    const double away = length(mix(1, vec3(photos[i].centre), -1, pose_.centre)) / size_;
    const double unlike = away + 1 - dot(vec3(photos[i].rotation + 6), pose_.rows[2]);
    if (unlike < smallest) smallest = unlike, nearest = int(i);
  }
  return nearest;
}

}  // namespace maquette
