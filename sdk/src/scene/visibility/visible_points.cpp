#include "scene/visibility/visible_points.h"

#include <algorithm>
#include <limits>

namespace maq {

void VisiblePoints::find(const PointPlaces& points, const PinholeCamera& camera, double near) {
  buffer_.begin(camera, near, 1);
  PointSpan span;
  for (size_t i = 0; i < 3; ++i) span.base[i] = points.origin[i] - camera.centre[i];
  for (size_t begin = 0; begin < points.count; begin += PointSpan::kMostPoints) {
    span.x = points.x + begin;
    span.y = points.y + begin;
    span.z = points.z + begin;
    span.count = uint32_t(std::min<size_t>(PointSpan::kMostPoints, points.count - begin));
    span.first = uint32_t(begin);
    buffer_.draw(span, 0);
  }
  buffer_.finish(0, camera.height_px);
  const size_t pixels = size_t(camera.width_px) * size_t(camera.height_px);
  winners_.resize(pixels);
  depths_.resize(pixels);
  for (size_t pixel = 0; pixel < pixels; ++pixel) {
    const DepthKey key = buffer_.keys()[pixel];
    winners_[pixel] = point_of(key);
    depths_[pixel] = key == kNoPointKey ? std::numeric_limits<float>::infinity() : depth_of(key);
  }
}

}  // namespace maq
