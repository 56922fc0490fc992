// The camera with which a user flies through a scene (scene.h), for C++17, in this header alone. Calls with a number that is
// not finite or a camera that is none do nothing.
#ifndef MAQUETTE_FLY_CAMERA_HPP_
#define MAQUETTE_FLY_CAMERA_HPP_

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <vector>

#include "maquette/maquette.hpp"

namespace maquette {

class FlyCamera {
 public:
  // Begins at the middle photo; without photos outside of the scene's box, looking at it.
  FlyCamera(const maq_scene_info& scene, const std::vector<maq_pinhole_camera>& photos);
  // Each -1 to 1: to the camera's right, along the world's up, forwards. `speed`: diagonals of the scene's box a second.
  void move(double right, double up, double forward, double seconds, double speed);
  // To the right about the world's up, and upwards, radians; ends short of straight up and down. A camera that leans to a
  // side gets upright by and by.
  void turn(double yaw, double pitch);
  void zoom(double factor);  // above 1 things get larger; the longer side keeps within 20 to 110 degrees
  // Flies there while update() is called, until the user steers; is there at once for 0 seconds.
  void go_to(const maq_pinhole_camera& camera, double seconds, int photo_index);
  bool update(double seconds);                                   // true when it moved
  maq_pinhole_camera camera(int width_px, int height_px) const;  // shows all that the photo it was at last would
  // What it began at or flew to, until it leaves: of the photo's own size, to be compared with it pixel by pixel.
  const std::optional<maq_pinhole_camera>& photo_camera() const { return at_; }
  int at_photo() const { return at_ ? photo_index_ : -1; }
  int nearest_photo(const std::vector<maq_pinhole_camera>& photos) const;  // by place and direction; -1 without photos

 private:
  using Vec3 = std::array<double, 3>;
  using Rows = std::array<Vec3, 3>;
  enum { kWidth, kHeight, kFx, kFy, kOffsetX, kOffsetY };  // the offset is the principal point's from the middle
  struct Pose {
    Rows rows;  // world to camera: to the right, down, forward
    Vec3 centre;
    std::array<double, 6> lens;  // pixels
  };
  static constexpr double kDegree = 3.14159265358979323846 / 180;

  static Vec3 vec3(const double* a) { return {a[0], a[1], a[2]}; }
  static double dot(const Vec3& a, const Vec3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
  // Not by the hypot of three numbers, which loses NaN in libstdc++ 12.
  static double length(const Vec3& a) { return std::hypot(std::hypot(a[0], a[1]), a[2]); }
  static bool finite(const Vec3& a) { return std::isfinite(length(a)); }
  static Vec3 mix(double s, const Vec3& a, double t, const Vec3& b) {
    return {s * a[0] + t * b[0], s * a[1] + t * b[1], s * a[2] + t * b[2]};
  }
  static Vec3 unit(const Vec3& a) { return mix(1 / length(a), a, 0, a); }
  static Vec3 cross(const Vec3& a, const Vec3& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
  }
  static Rows rotation_of(const Vec3& right, const Vec3& forward) {
    const Vec3 ahead = unit(forward), aside = unit(mix(1, right, -dot(right, ahead), ahead));
    return {aside, cross(ahead, aside), ahead};
  }
  // About an axis of length 1 (Rodrigues' formula).
  static Rows turned(const Rows& rows, const Vec3& axis, double angle) {
    const auto turn = [&](const Vec3& row) {
      const Vec3 along = mix(dot(row, axis), axis, 0, axis), across = mix(1, row, -1, along);
      return mix(1, along, 1, mix(std::cos(angle), across, std::sin(angle), cross(axis, row)));
    };
    return rotation_of(turn(rows[0]), turn(rows[2]));
  }
  // On the shortest arc between two rotations.
  static Rows between(const Rows& from, const Rows& to, double share) {
    Vec3 sines{}, longest{};  // by half a turn the sine is 0; rows and what becomes of them then add up along the axis
    double cosines = -1;
    for (size_t i = 0; i < 3; ++i) {
      const Vec3 sum = mix(1, from[i], 1, to[i]);
      sines = mix(1, sines, 1, cross(from[i], to[i])), cosines += dot(from[i], to[i]);
      if (length(sum) > length(longest)) longest = sum;
    }
    return turned(from, unit(length(sines) > 1e-6 ? sines : longest), share * std::atan2(length(sines), cosines));
  }

  static std::optional<Pose> pose_of(const maq_pinhole_camera& camera);
  void leave() { at_.reset(), target_.reset(); }

  Vec3 up_;          // the world's
  double size_ = 1;  // the box's diagonal
  Pose pose_, from_, to_;
  std::optional<maq_pinhole_camera> at_, target_;  // target: while it flies
  int photo_index_ = -1;
  double flight_s_ = 0, flown_s_ = 0;
};

inline FlyCamera::FlyCamera(const maq_scene_info& scene, const std::vector<maq_pinhole_camera>& photos)
    : up_(unit(vec3(scene.up))) {
  if (!finite(up_)) up_ = {0, 0, 1};
  Vec3 middle = mix(0.5, vec3(scene.bounds_min), 0.5, vec3(scene.bounds_max));
  if (!finite(middle)) middle = {};
  // A box without a size, or with one that is lost in 16 digits so far out, gets one in which one can move.
  const double diagonal = length(mix(1, vec3(scene.bounds_max), -1, vec3(scene.bounds_min))), far_out = length(middle);
  size_ = diagonal > 1e-10 * far_out && std::isfinite(diagonal) ? diagonal : std::max(1.0, 1e-6 * far_out);
  // From a little above, 60 degrees wide: the ball about the box fills the picture.
  const Vec3 right = unit(cross(up_, std::abs(up_[0]) < 0.9 ? Vec3{1, 0, 0} : Vec3{0, 1, 0}));
  const Vec3 ahead = unit(mix(2, cross(up_, right), -1, up_));
  pose_ = {rotation_of(right, ahead), mix(1, middle, -size_, ahead), {640, 480, 415, 415, 0, 0}};
  if (!photos.empty()) go_to(photos[photos.size() / 2], 0, int(photos.size() / 2));
}

inline std::optional<FlyCamera::Pose> FlyCamera::pose_of(const maq_pinhole_camera& camera) {
  const double w = camera.width_px, h = camera.height_px, fx = camera.fx_px, fy = camera.fy_px;
  const Rows given{vec3(camera.rotation), vec3(camera.rotation + 3), vec3(camera.rotation + 6)};
  Pose pose{rotation_of(given[0], given[2]), vec3(camera.centre), {w, h, fx, fy}};
  pose.lens[kOffsetX] = camera.cx_px - (w - 1) / 2, pose.lens[kOffsetY] = camera.cy_px - (h - 1) / 2;
  double off = 0;  // cameras' rotations may be off by 0.001
  for (size_t row = 0; row < 3; ++row) off += length(mix(1, pose.rows[row], -1, given[row]));
  for (const double number : pose.lens) off += std::isfinite(number) ? 0 : 1;
  if (!(off < 0.02 && w > 0 && h > 0 && fx > 0 && fy > 0 && finite(pose.centre))) return {};
  if (off < 1e-10) pose.rows = given;
  return pose;
}

inline void FlyCamera::move(double right, double up, double forward, double seconds, double speed) {
  const auto way = [&](double share) { return std::clamp(share, -1.0, 1.0) * seconds * speed * size_; };
  const Vec3 level = mix(way(right), pose_.rows[0], way(forward), pose_.rows[2]);
  const Vec3 centre = mix(1, pose_.centre, 1, mix(1, level, way(up), up_));
  if (!finite(centre) || centre == pose_.centre) return;
  leave();
  pose_.centre = centre;
}

inline void FlyCamera::turn(double yaw, double pitch) {
  if (!std::isfinite(yaw) || !std::isfinite(pitch) || (yaw == 0 && pitch == 0)) return;
  leave();
  Rows rows = turned(pose_.rows, up_, -yaw);
  // To the right, if it did not lean; straight up or down nothing leans.
  const Vec3 across = cross(rows[2], up_);
  const Vec3 level = unit(length(across) > 0.01 ? across : mix(1, rows[0], -dot(rows[0], up_), up_));
  const double steep = std::atan2(dot(rows[2], up_), length(across));
  rows = turned(rows, level, std::clamp(steep + pitch, -89 * kDegree, 89 * kDegree) - steep);
  const double lean = std::atan2(dot(rows[0], cross(rows[2], level)), dot(rows[0], level));
  pose_.rows = turned(rows, rows[2], lean * std::expm1(-std::abs(yaw) - std::abs(pitch)));
}

inline void FlyCamera::zoom(double factor) {
  if (!std::isfinite(factor) || factor <= 0 || factor == 1) return;
  leave();
  double &fx = pose_.lens[kFx], half_px = std::max(pose_.lens[kWidth], pose_.lens[kHeight]) / 2;
  const double scale = std::clamp(fx * factor, half_px / std::tan(55 * kDegree), half_px / std::tan(10 * kDegree)) / fx;
  fx *= scale, pose_.lens[kFy] *= scale;
}

inline void FlyCamera::go_to(const maq_pinhole_camera& camera, double seconds, int photo_index) {
  const std::optional<Pose> to = pose_of(camera);
  if (!to || !std::isfinite(seconds)) return;
  leave();
  from_ = pose_, to_ = *to, target_ = camera, photo_index_ = photo_index, flight_s_ = seconds, flown_s_ = 0;
  if (seconds <= 0) update(0);
}

inline bool FlyCamera::update(double seconds) {
  if (!target_ || !(seconds >= 0)) return false;
  flown_s_ += seconds;
  if (flown_s_ >= flight_s_) {
    pose_ = to_, at_ = target_;
    target_.reset();
    return true;
  }
  const double t = flown_s_ / flight_s_, share = t * t * (3 - 2 * t);
  pose_.rows = between(from_.rows, to_.rows, share);
  pose_.centre = mix(1 - share, from_.centre, share, to_.centre);
  for (size_t i = 0; i < 6; ++i) pose_.lens[i] = (1 - share) * from_.lens[i] + share * to_.lens[i];
  return true;
}

inline maq_pinhole_camera FlyCamera::camera(int width_px, int height_px) const {
  const std::array<double, 6>& lens = pose_.lens;
  const double scale = std::min(width_px / lens[kWidth], height_px / lens[kHeight]);
  maq_pinhole_camera camera{sizeof camera, width_px, height_px, lens[kFx] * scale, lens[kFy] * scale, 0, 0, {}, {}, {}};
  camera.cx_px = (width_px - 1) / 2.0 + lens[kOffsetX] * scale;
  camera.cy_px = (height_px - 1) / 2.0 + lens[kOffsetY] * scale;
  for (size_t i = 0; i < 9; ++i) camera.rotation[i] = pose_.rows[i / 3][i % 3];
  std::copy(pose_.centre.begin(), pose_.centre.end(), camera.centre);
  return camera;
}

inline int FlyCamera::nearest_photo(const std::vector<maq_pinhole_camera>& photos) const {
  int nearest = -1;
  double least = HUGE_VAL;
  for (size_t i = 0; i < photos.size(); ++i) {
    const double away = length(mix(1, vec3(photos[i].centre), -1, pose_.centre)) / size_;
    const double unlike = away + 1 - dot(vec3(photos[i].rotation + 6), pose_.rows[2]);
    if (unlike < least) least = unlike, nearest = int(i);
  }
  return nearest;
}

}  // namespace maquette

#endif  // MAQUETTE_FLY_CAMERA_HPP_
