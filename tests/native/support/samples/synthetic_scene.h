// Synthetic fitted points, and cameras, for tests of rendering.
#pragma once

#include <cmath>
#include <random>

#include "image/geometry/pinhole_camera.h"
#include "scene/format/fitted_points.h"

// Around (0, 0, 3) in units of `unit`, moved by `origin`; all depths differ unless `copies` points
// are to be at each position.
inline maq::FittedPoints synthetic_points(size_t count, unsigned seed = 1, double unit = 1,
                                          const std::array<double, 3>& origin = {0, 0, 0}, size_t copies = 1) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> across(-1.5f, 1.5f), depth(1.5f, 5.0f);
  maq::FittedPoints points;
  points.origin = origin;
  points.up = {0, -1, 0};
  points.background = {0.25f, 0.5f, 0.75f};
  for (size_t i = 0; i < count; ++i) {
    if (i % copies == 0) {
      points.x.push_back(float(unit * across(random)));
      points.y.push_back(float(unit * across(random)));
      points.z.push_back(float(unit * depth(random)));
    } else {
      points.x.push_back(points.x.back());
      points.y.push_back(points.y.back());
      points.z.push_back(points.z.back());
    }
    const bool is_view_dependent = random() % 3 != 0;
    points.views.push_back(4);
    points.view_dependence.push_back(is_view_dependent ? 1.0f : 0.0f);
    for (int c = 0; c < maq::kFeatures; ++c) points.constant_terms.push_back(0.5f + 0.3f * across(random));
    for (int k = 0; k < maq::kBasis * maq::kFeatures; ++k) {
      points.linear_terms.push_back(is_view_dependent ? 0.1f * across(random) : 0.0f);
    }
  }
  return points;
}

// Looks along +z with +y down, `degrees` wide.
inline maq::PinholeCamera camera_of(int width, int height, double degrees) {
  maq::PinholeCamera camera;
  camera.width_px = width;
  camera.height_px = height;
  camera.fx_px = camera.fy_px = width / 2.0 / std::tan(degrees / 2 * M_PI / 180);
  camera.cx_px = (width - 1) / 2.0;
  camera.cy_px = (height - 1) / 2.0;
  return camera;
}

// The rotation of a quaternion (w, x, y, z) of any length.
inline std::array<double, 9> rotation_of(double w, double x, double y, double z) {
  const double length = std::sqrt(w * w + x * x + y * y + z * z);
  w /= length, x /= length, y /= length, z /= length;
  return {1 - 2 * (y * y + z * z), 2 * (x * y - z * w),     2 * (x * z + y * w),
          2 * (x * y + z * w),     1 - 2 * (x * x + z * z), 2 * (y * z - x * w),
          2 * (x * z - y * w),     2 * (y * z + x * w),     1 - 2 * (x * x + y * y)};
}

inline maq::PinholeCamera random_camera(std::mt19937& random, double unit = 1) {
  std::uniform_real_distribution<double> fraction(0, 1);
  std::normal_distribution<double> normal;
  maq::PinholeCamera camera = camera_of(1 + int(random() % 90), 1 + int(random() % 70), 1 + 169 * fraction(random));
  camera.rotation = rotation_of(normal(random), normal(random), normal(random), normal(random));
  for (double& value : camera.centre) value = 2 * unit * normal(random);
  camera.centre[2] += 3 * unit;  // where the points are
  camera.fy_px *= 0.5 + fraction(random);
  camera.cx_px += camera.width_px * normal(random);
  return camera;
}
