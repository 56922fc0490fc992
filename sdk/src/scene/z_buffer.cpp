#include "scene/z_buffer.h"

#include <algorithm>

#include "core/frame.h"
#include "core/simd_clones.h"

namespace maq {
namespace {

MAQ_SIMD_CLONES void take_least(DepthKey* __restrict into, const DepthKey* __restrict from, size_t count) {
  for (size_t i = 0; i < count; ++i) into[i] = from[i] < into[i] ? from[i] : into[i];
}

// In one row of blocks, of `height` rows of `width` pixels. What is deeper than the nearest times `factor` goes.
void hide_in_blocks(DepthKey* keys, size_t width, int height, float factor) {
  constexpr size_t kSide = ZBuffer::kHidingBlock;
  for (size_t left = 0; left < width; left += kSide) {
    const size_t right = std::min(width, left + kSide);
    DepthKey nearest = kNoPointKey;
    for (int y = 0; y < height; ++y) {
      for (size_t x = left; x < right; ++x) nearest = std::min(nearest, keys[size_t(y) * width + x]);
    }
    if (nearest == kNoPointKey) continue;
    const float limit = depth_of(nearest) * factor;
    uint32_t bits;
    std::memcpy(&bits, &limit, sizeof bits);
    const DepthKey last = DepthKey((uint64_t(bits) << 32) | UINT32_MAX);
    for (int y = 0; y < height; ++y) {
      for (size_t x = left; x < right; ++x) {
        DepthKey& key = keys[size_t(y) * width + x];
        if (key > last) key = kNoPointKey;
      }
    }
  }
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

void ZBuffer::finish(int top, int bottom, double hiding) {
  const size_t begin = size_t(top) * size_t(width_px_), count = size_t(bottom - top) * size_t(width_px_);
  DepthKey* const into = sheets_[0].keys.data() + begin;
  if (!sheets_[0].is_drawn) std::fill_n(into, count, kNoPointKey);
  for (size_t i = 1; i < sheets_.size(); ++i) {
    if (sheets_[i].is_drawn) take_least(into, sheets_[i].keys.data() + begin, count);
  }
  if (hiding < std::numeric_limits<float>::max()) {
    for (int row = top; row < bottom; row += kHidingBlock) {
      hide_in_blocks(sheets_[0].keys.data() + size_t(row) * size_t(width_px_), size_t(width_px_),
                     std::min(kHidingBlock, bottom - row), float(1 + hiding));
    }
  }
}

}  // namespace maq
