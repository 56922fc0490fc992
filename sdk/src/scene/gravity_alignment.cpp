#include "scene/gravity_alignment.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/rounding.h"

namespace maq {

PixelMap pixels_between(const PinholeCamera& source, const PinholeCamera& target) {
  // The turn: target.rotation * source.rotation^T, of which only the part across the axis is not trivial.
  double turn[2][2] = {};
  for (size_t i = 0; i < 2; ++i) {
    for (size_t j = 0; j < 2; ++j) {
      for (size_t k = 0; k < 3; ++k) turn[i][j] += target.rotation[3 * i + k] * source.rotation[3 * j + k];
    }
  }
  const double focal[2] = {target.fx_px, target.fy_px}, centre[2] = {target.cx_px, target.cy_px};
  PixelMap map{};
  for (size_t i = 0; i < 2; ++i) {
    map[3 * i] = focal[i] * turn[i][0] / source.fx_px;
    map[3 * i + 1] = focal[i] * turn[i][1] / source.fy_px;
    map[3 * i + 2] = centre[i] - map[3 * i] * source.cx_px - map[3 * i + 1] * source.cy_px;
  }
  return map;
}

PinholeCamera upright_frame(const PinholeCamera& camera, const std::array<double, 3>& up, int multiple) {
  PinholeCamera turned = turned_upright(camera, up);
  const PixelMap map = pixels_between(camera, turned);
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
    constexpr double kFarthest = 1 << 20;
    if (!(std::abs(low) <= kFarthest && std::abs(high) <= kFarthest)) {
      throw Error(MAQ_ERROR_INVALID_ARGUMENT, "A picture turned upright would reach from pixel ", low, " to ", high,
                  ": the camera's focal lengths (", camera.fx_px, " and ", camera.fy_px, ") or its principal point (",
                  camera.cx_px, ", ", camera.cy_px, ") cannot be right.");
    }
    // A turn by an angle of rounding size must not widen the frame by a pixel.
    constexpr double kRounding = 1e-6;
    first[i] = int(std::floor(low + 0.5 + kRounding));
    const int whole = int(std::ceil(high + 0.5 - kRounding)) - first[i];
    size[i] = round_up(whole, multiple);
  }
  turned.width_px = size[0];
  turned.height_px = size[1];
  turned.cx_px -= first[0];
  turned.cy_px -= first[1];
  return turned;
}

}  // namespace maq
