#include "scene/visibility/z_buffer.h"

#include <algorithm>

#include "core/frame.h"
#include "core/simd_clones.h"

namespace maq {
namespace {

MAQ_SIMD_CLONES void take_least(DepthKey* __restrict into, const DepthKey* __restrict from, size_t count) {
  for (size_t i = 0; i < count; ++i) into[i] = from[i] < into[i] ? from[i] : into[i];
}

// The largest key of a point that is as deep as `nearest` or farther by at most that share.
DepthKey last_unhidden(DepthKey nearest, float factor) {
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
  sheets_.resize(size_t(workers));
  for (Sheet& sheet : sheets_) sheet.is_drawn = false;
  for (Sheet& sheet : sheets_) sheet.keys.resize(size_t(width_px_) * size_t(height_px_) + 1);
}

void ZBuffer::clear(Sheet& sheet) {
  std::fill(sheet.keys.begin(), sheet.keys.end(), kNoPointKey);
  sheet.is_drawn = true;
}

void ZBuffer::draw(const PointSpan& span, int worker) {
  Sheet& sheet = sheets_[size_t(worker)];
  if (!sheet.is_drawn) clear(sheet);
  int32_t pixels[PointSpan::kMostPoints];
  float depths[PointSpan::kMostPoints];
  projection_.project(span, pixels, depths);
  DepthKey* const keys = sheet.keys.data();
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
  DepthKey* const into = sheets_[0].keys.data() + begin;
  if (!sheets_[0].is_drawn) std::fill_n(into, count, kNoPointKey);
  for (size_t i = 1; i < sheets_.size(); ++i) {
    if (sheets_[i].is_drawn) take_least(into, sheets_[i].keys.data() + begin, count);
  }
}

void ZBuffer::hide(int top, int bottom, double share) {
  const float factor = float(1 + share);
  const size_t width = size_t(width_px_);
  for (int y = top; y < bottom; y += kHidingPx) {
    const int rows = std::min(kHidingPx, bottom - y);
    DepthKey* const first = sheets_[0].keys.data() + size_t(y) * width;
    for (size_t x = 0; x < width; x += kHidingPx) {
      const size_t columns = std::min<size_t>(kHidingPx, width - x);
      DepthKey nearest = kNoPointKey;
      for (int row = 0; row < rows; ++row) {
        const DepthKey* const keys = first + size_t(row) * width + x;
        for (size_t i = 0; i < columns; ++i) nearest = std::min(nearest, keys[i]);
      }
      const DepthKey last = last_unhidden(nearest, factor);
      for (int row = 0; row < rows; ++row) {
        DepthKey* const keys = first + size_t(row) * width + x;
        for (size_t i = 0; i < columns; ++i) keys[i] = keys[i] > last ? kNoPointKey : keys[i];
      }
    }
  }
}

}  // namespace maq
