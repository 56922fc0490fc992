// Projects points to a camera's image: one pixel a point (NPBG++, arXiv 2203.13318, section 3.4).
#pragma once

#include <cstdint>

#include "image/geometry/pinhole_camera.h"
#include "scene/format/scene.h"

namespace maq {

// Points that are neighbours in memory, as one camera sees them: a position, with the camera's centre as origin and the
// axes of the world, is base + step * what is stored, one array for each coordinate.
struct PointSpan {
  static constexpr uint32_t kMaxPoints = SceneBlock::kMaxPoints;
  PositionFormat kind = PositionFormat::kFloat32;
  const void* x = nullptr;
  const void* y = nullptr;
  const void* z = nullptr;
  uint32_t count = 0;  // at most kMaxPoints
  uint32_t first = 0;  // index of the first point
  double base[3] = {0, 0, 0}, step[3] = {1, 1, 1};

  // Vector from the camera's centre to point i. The sum is in double: scenes may lie far from the origin of the world.
  template <class Stored>
  void offset(uint32_t i, float away[3]) const {
    const void* const from[3] = {x, y, z};
    for (int axis = 0; axis < 3; ++axis) {
      away[axis] = float(base[axis] + step[axis] * double(static_cast<const Stored*>(from[axis])[i]));
    }
  }
};

PointSpan span_of(const Scene& scene, const SceneBlock& block, const std::array<double, 3>& camera_centre);

class PointProjection {
 public:
  PointProjection() = default;
  // Points nearer than `near` (in units of the scene, along the optical axis) are outside.
  PointProjection(const PinholeCamera& camera, double near);

  // For each point its pixel, row * width + column, or width * height if it is outside of the image or not finite; and
  // its depth along the optical axis, which is undefined outside of the image.
  void project(const PointSpan& span, int32_t* pixels, float* depths) const;

 private:
  float rotation_[9] = {};  // the first two rows times the focal lengths
  float cx_ = 0, cy_ = 0, near_ = 1;
  int width_px_ = 0, height_px_ = 0;
};

}  // namespace maq
