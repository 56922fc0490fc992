// Which point of a cloud each pixel of a picture shows (z_buffer.h).
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "scene/visibility/z_buffer.h"

namespace maq {

inline constexpr uint32_t kNoPoint = UINT32_MAX;

// Places of points, one array for each coordinate, relative to `origin`.
struct PointPlaces {
  const float* x = nullptr;
  const float* y = nullptr;
  const float* z = nullptr;
  size_t count = 0;
  std::array<double, 3> origin = {0, 0, 0};
};

class VisiblePoints {
 public:
  // Points nearer than `near` (in units of the scene, along the optical axis) are not seen. Where several have the same
  // depth the lowest index wins. Points that are not finite are never seen.
  void find(const PointPlaces& points, const PinholeCamera& camera, double near);

  int width_px() const { return buffer_.width_px(); }
  int height_px() const { return buffer_.height_px(); }
  // Row by row: the index of the point, kNoPoint where there is none.
  const std::vector<uint32_t>& winners() const { return winners_; }
  // Its depth along the optical axis; infinite where there is none.
  const std::vector<float>& depths() const { return depths_; }

 private:
  ZBuffer buffer_;
  std::vector<uint32_t> winners_;
  std::vector<float> depths_;
};

}  // namespace maq
