#include "densepose/texture/surface_lookup.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace maq {
namespace {

constexpr float kByteStep = 1.0f / 255;  // of U and V in the planes
constexpr float kRounding = 1e-6f;

// Calls `visit` with x, y and the distance of each pixel of the person that shows the part.
template <class Visit>
void for_each_pixel(const DensePlanes& planes, uint8_t person, int part, float u, float v, const Visit& visit) {
  for (int y = 0; y < planes.height_px; ++y) {
    const size_t row = size_t(y) * size_t(planes.width_px);
    for (int x = 0; x < planes.width_px; ++x) {
      const size_t at = row + size_t(x);
      if (planes.person[at] != person || planes.part[at] != part) continue;
      visit(x, y, std::hypot(float(planes.u[at]) * kByteStep - u, float(planes.v[at]) * kByteStep - v));
    }
  }
}

}  // namespace

std::optional<SurfacePixel> find_surface_pixel(const DensePlanes& planes, uint8_t person, int part, float u, float v) {
  float nearest = std::numeric_limits<float>::infinity();
  for_each_pixel(planes, person, part, u, v, [&](int, int, float distance) { nearest = std::min(nearest, distance); });
  if (std::isinf(nearest)) return std::nullopt;
  double x_sum = 0, y_sum = 0, count = 0;
  for_each_pixel(planes, person, part, u, v, [&](int x, int y, float distance) {
    if (distance > nearest + kRounding) return;
    x_sum += x + 0.5;
    y_sum += y + 0.5;
    ++count;
  });
  return SurfacePixel{float(x_sum / count), float(y_sum / count), nearest};
}

}  // namespace maq
