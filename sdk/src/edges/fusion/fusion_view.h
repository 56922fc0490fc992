// The field of one posed view as fusion keeps it, and what it says of points in space.
#pragma once

#include <cstdint>
#include <vector>

#include "core/math/vec3.h"
#include "edges/edge_field.h"
#include "image/geometry/pinhole_camera.h"

namespace maq {

// A surface's normal is fitted to pixels up to so many to either side.
inline constexpr int kNormalWindow_px = 2;

class FusionView {
 public:
  // Six bytes a pixel. Depth that is not a positive number is unknown, distances that are not numbers are eps_r.
  FusionView(const EdgeField& field, const PinholeCamera& pose);

  const PinholeCamera& camera() const { return camera_; }
  double focal_px() const { return focal_px_; }
  int64_t known_pixels() const { return known_pixels_; }
  double median_depth_m() const { return median_depth_m_; }

  double depth(int x, int y) const { return depth_m_[size_t(y) * size_t(camera_.width_px) + size_t(x)]; }
  // In camera coordinates.
  Vec3 point(int x, int y) const;
  // Of length 1 and towards the camera, in its coordinates: of the plane through inverse depth, which is linear in the
  // pixel, by least squares over the pixels nearby in depth. Where they do not determine one, the way to the camera.
  Vec3 normal(int x, int y) const;

  // Metres from a point of camera coordinates to the nearest sharp curve, interpolated between those of the four
  // pixels about it that are within reach_r of it, and eps_r * r_m where that is as far as this view can tell; negative
  // where the nearest of them is not, so that the view did not see the point's surface.
  double distance_m(Vec3 at, double r_m, double reach_r) const;

  Vec3 to_camera(Vec3 direction) const;
  Vec3 to_world(Vec3 direction) const;

 private:
  double distance_r(size_t pixel) const { return distance_[pixel] * (eps_r_ / kSteps); }

  static constexpr double kSteps = 65535;

  PinholeCamera camera_;
  double focal_px_, eps_r_;
  int64_t known_pixels_ = 0;
  double median_depth_m_ = 0;
  std::vector<float> depth_m_;
  std::vector<uint16_t> distance_;  // kSteps: eps_r
};

}  // namespace maq
