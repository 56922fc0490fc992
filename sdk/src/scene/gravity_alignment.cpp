#include "scene/gravity_alignment.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/rounding.h"

namespace maq {

PinholeCamera gravity_aligned(const PinholeCamera& camera, const std::array<double, 3>& up) {
  const auto& r = camera.rotation;
  const double length = std::sqrt(up[0] * up[0] + up[1] * up[1] + up[2] * up[2]);
  if (!(length > 0) || !std::isfinite(length)) return camera;
  // The world's up as the camera sees it, across its axis.
  const double across = (r[0] * up[0] + r[1] * up[1] + r[2] * up[2]) / length;
  const double down = (r[3] * up[0] + r[4] * up[1] + r[5] * up[2]) / length;
  const double seen = std::hypot(across, down);
  // Nearly along the axis its direction in the image says less and less; the rotation fades out.
  constexpr double kFaintest = 0.05;
  const double angle = std::atan2(across, -down) * std::min(1.0, seen / kFaintest);
  const double cosine = std::cos(angle), sine = std::sin(angle);
  PinholeCamera made = camera;
  for (size_t i = 0; i < 3; ++i) {
    made.rotation[i] = cosine * r[i] + sine * r[3 + i];
    made.rotation[3 + i] = cosine * r[3 + i] - sine * r[i];
  }
  return made;
}

PixelMap pixel_map_between(const PinholeCamera& source, const PinholeCamera& target) {
  // The rotation: target.rotation * source.rotation^T, only the part across the axis is not trivial.
  double rotation[2][2] = {};
  for (size_t i = 0; i < 2; ++i) {
    for (size_t j = 0; j < 2; ++j) {
      for (size_t k = 0; k < 3; ++k) rotation[i][j] += target.rotation[3 * i + k] * source.rotation[3 * j + k];
    }
  }
  const double focal[2] = {target.fx_px, target.fy_px}, centre[2] = {target.cx_px, target.cy_px};
  PixelMap map{};
  for (size_t i = 0; i < 2; ++i) {
    map[3 * i] = focal[i] * rotation[i][0] / source.fx_px;
    map[3 * i + 1] = focal[i] * rotation[i][1] / source.fy_px;
    map[3 * i + 2] = centre[i] - map[3 * i] * source.cx_px - map[3 * i + 1] * source.cy_px;
  }
  return map;
}

PinholeCamera gravity_aligned_frame(const PinholeCamera& camera, const std::array<double, 3>& up, int multiple) {
  PinholeCamera aligned = gravity_aligned(camera, up);
  const PixelMap map = pixel_map_between(camera, aligned);
  const double sides[2] = {double(camera.width_px), double(camera.height_px)};
  int first[2], size[2];
  for (size_t i = 0; i < 2; ++i) {
    double low = INFINITY, high = -INFINITY;
    for (const double x : {-0.5, sides[0] - 0.5}) {
      for (const double y : {-0.5, sides[1] - 0.5}) {
        const double at = map[3 * i] * x + map[3 * i + 1] * y + map[3 * i + 2];
        low = std::min(low, at);
        high = std::max(high, at);
      }
    }
    constexpr double kFarthestPx = 1 << 20;
    if (!(std::abs(low) <= kFarthestPx && std::abs(high) <= kFarthestPx)) {
      throw Error(MAQ_ERROR_INVALID_ARGUMENT, "A gravity-aligned picture would reach from pixel ", low, " to ", high,
                  ": the camera's focal lengths (", camera.fx_px, " and ", camera.fy_px, ") or its principal point (",
                  camera.cx_px, ", ", camera.cy_px, ") cannot be right.");
    }
    // A rotation by an angle of rounding size must not widen the frame by a pixel.
    constexpr double kRoundingPx = 1e-6;
    first[i] = int(std::floor(low + 0.5 + kRoundingPx));
    const int whole = int(std::ceil(high + 0.5 - kRoundingPx)) - first[i];
    size[i] = round_up(whole, multiple);
  }
  aligned.width_px = size[0];
  aligned.height_px = size[1];
  aligned.cx_px -= first[0];
  aligned.cy_px -= first[1];
  return aligned;
}

}  // namespace maq
