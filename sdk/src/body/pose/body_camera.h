// How a camera shows a body. With known intrinsics it is a pinhole, and the body's place is in metres. Without them it
// is weak perspective: all points of a body have the scale of its first joint.
#pragma once

#include <cmath>

#include "core/math/vec3.h"

namespace maq::body {

struct BodyCamera {
  bool is_perspective = false;
  double fx_px = 0, fy_px = 0, cx_px = 0, cy_px = 0;  // of a perspective; the centre of the first pixel is (0, 0)
};

inline constexpr double kNearest_m = 0.2;  // depth of points that a pinhole shows

struct Pixel {
  double x = 0, y = 0;
};

// A pixel, and how it changes with the point (camera axes, from the first joint) and with the body's place.
struct Projection {
  Pixel at;
  Vec3 x_by_point, y_by_point;
  Vec3 x_by_place, y_by_place;
  bool is_shown = false;  // false: behind the camera, and the rest is not set
};

// place: pinhole: the first joint in metres. Weak perspective: its pixel (x, y), and the logarithm of pixels a metre.
inline Projection project(const BodyCamera& camera, Vec3 place, Vec3 point) {
  Projection made;
  if (!camera.is_perspective) {
    const double scale = std::exp(place.z);
    made.at = {place.x + scale * point.x, place.y + scale * point.y};
    made.x_by_point = {scale, 0, 0}, made.y_by_point = {0, scale, 0};
    made.x_by_place = {1, 0, scale * point.x}, made.y_by_place = {0, 1, scale * point.y};
    made.is_shown = std::isfinite(scale);
    return made;
  }
  const Vec3 q = place + point;
  if (!(q.z >= kNearest_m)) return made;
  const double u = q.x / q.z, v = q.y / q.z;
  made.at = {camera.cx_px + camera.fx_px * u, camera.cy_px + camera.fy_px * v};
  made.x_by_point = {camera.fx_px / q.z, 0, -camera.fx_px * u / q.z};
  made.y_by_point = {0, camera.fy_px / q.z, -camera.fy_px * v / q.z};
  made.x_by_place = made.x_by_point, made.y_by_place = made.y_by_point;
  made.is_shown = true;
  return made;
}

// Pixels a metre at the first joint.
inline double scale_at(const BodyCamera& camera, Vec3 place) {
  return camera.is_perspective ? std::sqrt(camera.fx_px * camera.fy_px) / place.z : std::exp(place.z);
}

// The place of a body whose first joint is at pixel `at`, with `scale` pixels a metre.
inline Vec3 place_of(const BodyCamera& camera, Pixel at, double scale) {
  if (!camera.is_perspective) return {at.x, at.y, std::log(scale)};
  const double depth = std::sqrt(camera.fx_px * camera.fy_px) / scale;
  return {(at.x - camera.cx_px) / camera.fx_px * depth, (at.y - camera.cy_px) / camera.fy_px * depth, depth};
}

}  // namespace maq::body
