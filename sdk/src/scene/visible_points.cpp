#include "scene/visible_points.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "core/simd_clones.h"

namespace maq {
namespace {

constexpr size_t kBlock = 256;
constexpr uint64_t kNothing = UINT64_MAX;

// What the projection of a block of points needs.
struct Projection {
  double from[3];     // the origin of the points as seen from the camera's centre
  float rotation[9];  // the first two rows times the focal lengths
  float cx, cy, near;
};

// Pixels (as floats, so that what is far outside stays comparable) and depths. The camera's centre is subtracted in
// double: scenes may lie far from the origin of the world.
MAQ_SIMD_CLONES void project(const Projection& by, const float* x, const float* y, const float* z, size_t count,
                             float* column, float* row, float* depth) {
  for (size_t i = 0; i < count; ++i) {
    const float dx = float(double(x[i]) + by.from[0]);
    const float dy = float(double(y[i]) + by.from[1]);
    const float dz = float(double(z[i]) + by.from[2]);
    const float forward = by.rotation[6] * dx + by.rotation[7] * dy + by.rotation[8] * dz;
    const float across = by.rotation[0] * dx + by.rotation[1] * dy + by.rotation[2] * dz;
    const float down = by.rotation[3] * dx + by.rotation[4] * dy + by.rotation[5] * dz;
    // Where it is not ahead of the camera the pixel does not matter; the division must only be one.
    const float safe = forward >= by.near ? forward : 1.0f;
    column[i] = across / safe + by.cx;
    row[i] = down / safe + by.cy;
    depth[i] = forward;
  }
}

}  // namespace

void VisiblePoints::find(const PointPlaces& points, const PinholeCamera& camera, double near) {
  width_px_ = camera.width_px;
  height_px_ = camera.height_px;
  const size_t pixels = size_t(width_px_) * size_t(height_px_);
  keys_.assign(pixels, kNothing);
  Projection by{};
  for (size_t i = 0; i < 3; ++i) {
    by.from[i] = points.origin[i] - camera.centre[i];
    by.rotation[i] = float(camera.rotation[i] * camera.fx_px);
    by.rotation[3 + i] = float(camera.rotation[3 + i] * camera.fy_px);
    by.rotation[6 + i] = float(camera.rotation[6 + i]);
  }
  by.cx = float(camera.cx_px);
  by.cy = float(camera.cy_px);
  by.near = float(std::max(near, double(std::numeric_limits<float>::min())));
  // Half a pixel around the centres of the first and the last.
  const float right = float(width_px_) - 0.5f, bottom = float(height_px_) - 0.5f;
  float column[kBlock], row[kBlock], depth[kBlock];
  for (size_t begin = 0; begin < points.count; begin += kBlock) {
    const size_t count = std::min(kBlock, points.count - begin);
    project(by, points.x + begin, points.y + begin, points.z + begin, count, column, row, depth);
    for (size_t i = 0; i < count; ++i) {
      // Comparisons with what is not finite are false.
      const bool is_seen = depth[i] >= by.near && depth[i] <= std::numeric_limits<float>::max() && column[i] >= -0.5f &&
                           column[i] < right && row[i] >= -0.5f && row[i] < bottom;
      if (!is_seen) continue;
      // The sum is rounded, on the last edge up to the pixel behind it.
      const int at_x = std::min(int(column[i] + 0.5f), width_px_ - 1),
                at_y = std::min(int(row[i] + 0.5f), height_px_ - 1);
      const size_t pixel = size_t(at_y) * size_t(width_px_) + size_t(at_x);
      uint32_t bits;  // of a positive float: ordered as it is
      std::memcpy(&bits, &depth[i], sizeof bits);
      const uint64_t key = (uint64_t(bits) << 32) | uint32_t(begin + i);
      keys_[pixel] = std::min(keys_[pixel], key);
    }
  }
  winners_.resize(pixels);
  depths_.resize(pixels);
  for (size_t pixel = 0; pixel < pixels; ++pixel) {
    const uint64_t key = keys_[pixel];
    const uint32_t bits = uint32_t(key >> 32);
    winners_[pixel] = uint32_t(key);
    std::memcpy(&depths_[pixel], &bits, sizeof bits);
    if (key == kNothing) depths_[pixel] = std::numeric_limits<float>::infinity();
  }
}

}  // namespace maq
