// Photos of surfaces with a texture, traced in double, with the true depth: for stereo.
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <vector>

#include "scene/point_cloud.h"
#include "scene/stereo/stereo_photo.h"

namespace textured_scene {

using Vector = std::array<double, 3>;

// The distance along a ray at which it meets the surface, in units of its direction; nothing if it does not.
using Surface = std::function<std::optional<double>(const Vector& from, const Vector& along)>;

inline double dot(const Vector& a, const Vector& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

// Points p with normal . p = offset.
inline Surface plane(const Vector& normal, double offset) {
  return [=](const Vector& from, const Vector& along) -> std::optional<double> {
    const double across = dot(normal, along), distance = (offset - dot(normal, from)) / across;
    if (across == 0 || !(distance > 0)) return {};
    return distance;
  };
}

inline Surface sphere(const Vector& centre, double radius) {
  return [=](const Vector& from, const Vector& along) -> std::optional<double> {
    const Vector to = {from[0] - centre[0], from[1] - centre[1], from[2] - centre[2]};
    const double a = dot(along, along), b = dot(to, along), c = dot(to, to) - radius * radius, root = b * b - a * c;
    if (root < 0 || -b - std::sqrt(root) <= 0) return {};
    return (-b - std::sqrt(root)) / a;
  };
}

// The nearer of two.
inline Surface both(const Surface& one, const Surface& other) {
  return [=](const Vector& from, const Vector& along) -> std::optional<double> {
    const auto a = one(from, along), b = other(from, along);
    if (!a || !b) return a ? a : b;
    return std::min(*a, *b);
  };
}

// Grey of a point: waves of several lengths in all directions, the shortest 0.05.
inline double grey_at(const Vector& point) {
  double sum = 0;
  for (int i = 0; i < 10; ++i) {
    const double angle = 2.4 * i, rise = std::cos(1.7 * i), flat = std::sqrt(1 - rise * rise), length = 0.05 + 0.03 * i;
    const Vector wave = {flat * std::cos(angle), flat * std::sin(angle), rise};
    sum += std::sin(6.283185 * dot(wave, point) / length + 1.1 * i);
  }
  return std::min(std::max(127.5 + 25 * sum, 0.0), 255.0);
}

inline maq::PinholeCamera camera_at(const Vector& centre, int width_px = 160, int height_px = 120) {
  maq::PinholeCamera camera;
  camera.width_px = width_px;
  camera.height_px = height_px;
  camera.fx_px = camera.fy_px = 1.1 * width_px;
  camera.cx_px = 0.5 * (width_px - 1);
  camera.cy_px = 0.5 * (height_px - 1);
  camera.centre = centre;
  return camera;
}

// Turned about y, to the left.
inline maq::PinholeCamera turned(maq::PinholeCamera camera, double angle) {
  const double c = std::cos(angle), s = std::sin(angle);
  camera.rotation = {c, 0, s, 0, 1, 0, -s, 0, c};
  return camera;
}

struct TracedView {
  maq::StereoPhoto photo;
  std::vector<double> depth;  // along the optical axis; 0: no surface
};

// `exposure`: factor of the grey levels.
inline TracedView view_of(const Surface& surface, const maq::PinholeCamera& camera, double exposure = 1) {
  TracedView view;
  view.photo.camera = camera;
  const auto& r = camera.rotation;
  for (int y = 0; y < camera.height_px; ++y) {
    for (int x = 0; x < camera.width_px; ++x) {
      const Vector at = {(x - camera.cx_px) / camera.fx_px, (y - camera.cy_px) / camera.fy_px, 1};
      Vector along, point;
      for (size_t k = 0; k < 3; ++k) along[k] = r[k] * at[0] + r[3 + k] * at[1] + r[6 + k] * at[2];
      const auto distance = surface(camera.centre, along);
      for (size_t k = 0; k < 3; ++k) point[k] = camera.centre[k] + along[k] * distance.value_or(0);
      view.depth.push_back(distance.value_or(0));
      view.photo.grey.push_back(distance ? uint8_t(std::min(exposure * grey_at(point) + 0.5, 255.0)) : uint8_t(0));
    }
  }
  return view;
}

// The fraction of the pixels whose depth is within `tolerance`. Pixels within `border_px` of the edge do not count.
inline double fraction_right(const TracedView& view, const std::vector<float>& depth, double tolerance,
                             int border_px = 8) {
  const int width = view.photo.camera.width_px, height = view.photo.camera.height_px;
  double right = 0, all = 0;
  for (int y = border_px; y < height - border_px; ++y) {
    for (int x = border_px; x < width - border_px; ++x) {
      const size_t i = size_t(y * width + x);
      if (view.depth[i] == 0) continue;
      ++all;
      if (std::abs(double(depth[i]) - view.depth[i]) <= tolerance * view.depth[i]) ++right;
    }
  }
  return right / all;
}

// Points on the surface that the cameras see, every `step` pixels: a sparse cloud.
inline maq::PointCloud sparse_points(const std::vector<TracedView>& views, int step) {
  maq::PointCloud cloud;
  for (const TracedView& view : views) {
    const maq::PinholeCamera& camera = view.photo.camera;
    for (int y = step / 2; y < camera.height_px; y += step) {
      for (int x = step / 2; x < camera.width_px; x += step) {
        const double z = view.depth[size_t(y * camera.width_px + x)];
        if (z == 0) continue;
        const Vector at = {(x - camera.cx_px) / camera.fx_px * z, (y - camera.cy_px) / camera.fy_px * z, z};
        Vector point = camera.centre;
        for (size_t k = 0; k < 3; ++k) {
          for (size_t row = 0; row < 3; ++row) point[k] += camera.rotation[3 * row + k] * at[row];
        }
        cloud.add(point[0], point[1], point[2]);
      }
    }
  }
  return cloud;
}

}  // namespace textured_scene
