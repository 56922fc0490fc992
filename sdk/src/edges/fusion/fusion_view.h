// The field of one posed view in the form that fusion keeps, and its distances for points in space.
#pragma once

#include <cstdint>
#include <vector>

#include "core/math/vec3.h"
#include "edges/edge_field.h"
#include "image/geometry/pinhole_camera.h"

namespace maq {

// The radius in pixels for fitting the normal of a surface.
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
  // Returns a point in camera coordinates.
  Vec3 point(int x, int y) const;
  // Returns the normal (length 1, towards the camera, in its coordinates) of the plane through inverse depth, fitted by
  // least squares to pixels of similar depth. If they do not determine a plane, it is the direction to the camera.
  Vec3 normal(int x, int y) const;

  // Returns the distance in metres from a point in camera coordinates to the nearest sharp curve, interpolated between
  // the four pixels around it that are within reach_r. It is eps_r * r_m where this view sees no edge. Negative: the
  // nearest pixel is not within reach, so that the view did not see the point's surface.
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
