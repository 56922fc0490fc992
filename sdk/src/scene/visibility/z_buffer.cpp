#include "scene/visibility/z_buffer.h"

#include <algorithm>

#include "core/frame.h"
#include "core/simd_clones.h"

namespace maq {
namespace {

MAQ_SIMD_CLONES void take_nearest(DepthKey* __restrict into, const DepthKey* __restrict from, size_t count) {
  for (size_t i = 0; i < count; ++i) into[i] = from[i] < into[i] ? from[i] : into[i];
}

// The largest key of a point that `nearest` does not occlude.
DepthKey last_visible(DepthKey nearest, float factor) {
  if (nearest == kNoPointKey) return kNoPointKey;
  const float depth = depth_of(nearest) * factor;
  uint32_t bits;
  std::memcpy(&bits, &depth, sizeof bits);
  return DepthKey((uint64_t(bits) << 32) | std::numeric_limits<uint32_t>::max());
}

}  // namespace

void ZBuffer::begin(const PinholeCamera& camera, double near, int workers) {
  check_image_size(camera.width_px, camera.height_px, "The picture of the points");
  projection_ = PointProjection(camera, near);
  width_px_ = camera.width_px;
  height_px_ = camera.height_px;
  buffers_.resize(size_t(workers));
  for (DepthBuffer& buffer : buffers_) buffer.is_drawn = false;
  for (DepthBuffer& buffer : buffers_) buffer.keys.resize(size_t(width_px_) * size_t(height_px_) + 1);
}

void ZBuffer::clear(DepthBuffer& buffer) {
  std::fill(buffer.keys.begin(), buffer.keys.end(), kNoPointKey);
  buffer.is_drawn = true;
}

void ZBuffer::draw(const PointSpan& span, int worker) {
  DepthBuffer& buffer = buffers_[size_t(worker)];
  if (!buffer.is_drawn) clear(buffer);
  int32_t pixels[PointSpan::kMaxPoints];
  float depths[PointSpan::kMaxPoints];
  projection_.project(span, pixels, depths);
  DepthKey* const keys = buffer.keys.data();
  for (uint32_t i = 0; i < span.count; ++i) {
    uint32_t bits;
    std::memcpy(&bits, &depths[i], sizeof bits);
    const DepthKey key = DepthKey((uint64_t(bits) << 32) | (span.first + i));
    DepthKey& there = keys[pixels[i]];
    there = std::min(there, key);
  }
}

void ZBuffer::finish(int top, int bottom) {
  const size_t begin = size_t(top) * size_t(width_px_), count = size_t(bottom - top) * size_t(width_px_);
  DepthKey* const into = buffers_[0].keys.data() + begin;
  if (!buffers_[0].is_drawn) std::fill_n(into, count, kNoPointKey);
  for (size_t i = 1; i < buffers_.size(); ++i) {
    if (buffers_[i].is_drawn) take_nearest(into, buffers_[i].keys.data() + begin, count);
  }
}

void ZBuffer::remove_occluded(int top, int bottom, double depth_tolerance) {
  const float factor = float(1 + depth_tolerance);
  const size_t width = size_t(width_px_);
  for (int y = top; y < bottom; y += kOcclusionBlockPx) {
    const int rows = std::min(kOcclusionBlockPx, bottom - y);
    DepthKey* const first = buffers_[0].keys.data() + size_t(y) * width;
    for (size_t x = 0; x < width; x += kOcclusionBlockPx) {
      const size_t columns = std::min<size_t>(kOcclusionBlockPx, width - x);
      DepthKey nearest = kNoPointKey;
      for (int row = 0; row < rows; ++row) {
        const DepthKey* const keys = first + size_t(row) * width + x;
        for (size_t i = 0; i < columns; ++i) nearest = std::min(nearest, keys[i]);
      }
      const DepthKey last = last_visible(nearest, factor);
      for (int row = 0; row < rows; ++row) {
        DepthKey* const keys = first + size_t(row) * width + x;
        for (size_t i = 0; i < columns; ++i) keys[i] = keys[i] > last ? kNoPointKey : keys[i];
      }
    }
  }
}

}  // namespace maq
