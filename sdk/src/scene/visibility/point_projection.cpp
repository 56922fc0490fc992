#include "scene/visibility/point_projection.h"

#include <algorithm>
#include <limits>

#include "core/simd_clones.h"

namespace maq {
namespace {

struct Parameters {
  float rotation[9];
  float cx, cy, near;
  int width, height;
};

template <class Stored>
inline void project_all(const Parameters& by, const PointSpan& span, int32_t* __restrict pixels,
                        float* __restrict depths) {
  const Stored* const x = static_cast<const Stored*>(span.x);
  const Stored* const y = static_cast<const Stored*>(span.y);
  const Stored* const z = static_cast<const Stored*>(span.z);
  const double base[3] = {span.base[0], span.base[1], span.base[2]};
  const double step[3] = {span.step[0], span.step[1], span.step[2]};
  const float r[9] = {by.rotation[0], by.rotation[1], by.rotation[2], by.rotation[3], by.rotation[4],
                      by.rotation[5], by.rotation[6], by.rotation[7], by.rotation[8]};
  const float cx = by.cx, cy = by.cy, near = by.near, far = std::numeric_limits<float>::max();
  // Half a pixel around the centres of the first and the last.
  const float right = float(by.width) - 0.5f, bottom = float(by.height) - 0.5f;
  const int width = by.width, last_column = by.width - 1, last_row = by.height - 1, nowhere = by.width * by.height;
  for (uint32_t i = 0; i < span.count; ++i) {
    const float dx = float(base[0] + step[0] * double(x[i]));
    const float dy = float(base[1] + step[1] * double(y[i]));
    const float dz = float(base[2] + step[2] * double(z[i]));
    const float forward = r[6] * dx + r[7] * dy + r[8] * dz;
    const float across = r[0] * dx + r[1] * dy + r[2] * dz;
    const float down = r[3] * dx + r[4] * dy + r[5] * dz;
    // Behind the camera the pixel does not matter; the division must only not be by 0.
    const float safe = forward >= near ? forward : 1.0f;
    const float column = across / safe + cx, row = down / safe + cy;
    // Comparisons with values that are not finite are false. All are made, so that there are no jumps.
    const bool is_seen = bool(int(forward >= near) & int(forward <= far) & int(column >= -0.5f) & int(column < right) &
                              int(row >= -0.5f) & int(row < bottom));
    // The sum is rounded, on the last edge up to the pixel behind it.
    const int at_x = std::min(int((is_seen ? column : 0.0f) + 0.5f), last_column);
    const int at_y = std::min(int((is_seen ? row : 0.0f) + 0.5f), last_row);
    pixels[i] = is_seen ? at_y * width + at_x : nowhere;
    depths[i] = forward;
  }
}

MAQ_SIMD_CLONES void project_floats(const Parameters& by, const PointSpan& span, int32_t* pixels, float* depths) {
  project_all<float>(by, span, pixels, depths);
}
MAQ_SIMD_CLONES void project_integers(const Parameters& by, const PointSpan& span, int32_t* pixels, float* depths) {
  project_all<uint16_t>(by, span, pixels, depths);
}

}  // namespace

PointSpan span_of(const Scene& scene, const SceneBlock& block, const std::array<double, 3>& camera_centre) {
  PointSpan span;
  span.kind = scene.position_format;
  span.count = block.count;
  span.first = block.first;
  const size_t size = size_bytes_of(scene.position_format);
  const char* const begin = static_cast<const char*>(scene.positions) + 3 * size_t(block.first) * size;
  span.x = begin;
  span.y = begin + block.count * size;
  span.z = begin + 2 * block.count * size;
  for (size_t axis = 0; axis < 3; ++axis) {
    span.base[axis] = scene.origin[axis] - camera_centre[axis];
    if (scene.position_format == PositionFormat::kUint16) {
      span.base[axis] += double(block.low[axis]);
      span.step[axis] = double(block.position_step[axis]);
    }
  }
  return span;
}

PointProjection::PointProjection(const PinholeCamera& camera, double near)
    : cx_(float(camera.cx_px)),
      cy_(float(camera.cy_px)),
      near_(float(std::max(near, double(std::numeric_limits<float>::min())))),
      width_px_(camera.width_px),
      height_px_(camera.height_px) {
  for (size_t i = 0; i < 3; ++i) {
    rotation_[i] = float(camera.rotation[i] * camera.fx_px);
    rotation_[3 + i] = float(camera.rotation[3 + i] * camera.fy_px);
    rotation_[6 + i] = float(camera.rotation[6 + i]);
  }
}

void PointProjection::project(const PointSpan& span, int32_t* pixels, float* depths) const {
  Parameters by{{}, cx_, cy_, near_, width_px_, height_px_};
  std::copy_n(rotation_, 9, by.rotation);
  if (span.kind == PositionFormat::kFloat32) {
    project_floats(by, span, pixels, depths);
  } else {
    project_integers(by, span, pixels, depths);
  }
}

}  // namespace maq
