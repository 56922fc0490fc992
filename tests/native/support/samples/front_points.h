// Which point of a cloud each pixel of an image shows, by the z-buffer.
#pragma once

#include <limits>
#include <vector>

#include "scene/point_cloud.h"
#include "scene/visibility/z_buffer.h"

inline constexpr uint32_t kNoPoint = UINT32_MAX;

// Row by row: the index of the front-most point, kNoPoint where there is none, and its depth along the optical axis,
// infinite where there is none.
struct FrontPoints {
  std::vector<uint32_t> points;
  std::vector<float> depths;

  FrontPoints(const maq::PointPositions& cloud, const maq::PinholeCamera& camera, double near) {
    static maq::ZBuffer buffer;  // with what an earlier image left
    buffer.begin(camera, near, 1);
    maq::PointSpan span;
    for (size_t i = 0; i < 3; ++i) span.base[i] = cloud.origin[i] - camera.centre[i];
    for (size_t begin = 0; begin < cloud.count; begin += maq::PointSpan::kMaxPoints) {
      span.x = cloud.x + begin;
      span.y = cloud.y + begin;
      span.z = cloud.z + begin;
      span.count = uint32_t(std::min<size_t>(maq::PointSpan::kMaxPoints, cloud.count - begin));
      span.first = uint32_t(begin);
      buffer.draw(span, 0);
    }
    buffer.finish(0, camera.height_px);
    const size_t pixels = size_t(camera.width_px) * size_t(camera.height_px);
    for (size_t pixel = 0; pixel < pixels; ++pixel) {
      const maq::DepthKey key = buffer.keys()[pixel];
      const bool is_empty = key == maq::kNoPointKey;
      points.push_back(is_empty ? kNoPoint : maq::point_of(key));
      depths.push_back(is_empty ? std::numeric_limits<float>::infinity() : maq::depth_of(key));
    }
  }
};
