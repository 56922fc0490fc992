#include "scene/splats/splat_chunks.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/rounding.h"

namespace maq {
namespace {

constexpr size_t kOpacityPlane = 3 + kAxesPlanes, kColourPlane = kOpacityPlane + 1, kPlanes = kColourPlane + 3;
constexpr float kMinOpacity = 1.0f / 255;
// A pixel shows a splat up to there, in standard deviations: 2 ln 255 is 3.33 squared.
constexpr float kMaxReach = 3.34f;

// Spreads 21 bits to every third one.
uint64_t every_third_bit(uint64_t bits) {
  bits = (bits | bits << 32) & 0x1f00000000ffff;
  bits = (bits | bits << 16) & 0x1f0000ff0000ff;
  bits = (bits | bits << 8) & 0x100f00f00f00f00f;
  bits = (bits | bits << 4) & 0x10c30c30c30c30c3;
  return (bits | bits << 2) & 0x1249249249249249;
}

// The splats to show, along a Z-order curve (Morton 1966) through the box of nearly all: single ones may be far away.
std::vector<uint32_t> order_in_space(const Splats& splats) {
  std::vector<uint32_t> shown;
  for (uint32_t i = 0; i < splats.count(); ++i) {
    if (splats.opacity[i] >= kMinOpacity) shown.push_back(i);
  }
  if (shown.empty()) return shown;
  std::array<float, 3> low{}, step{};
  std::vector<float> values(shown.size());
  for (size_t axis = 0; axis < 3; ++axis) {
    for (size_t i = 0; i < shown.size(); ++i) values[i] = splats.position[3 * size_t(shown[i]) + axis];
    const auto at = [&](size_t rank) {
      std::nth_element(values.begin(), values.begin() + std::ptrdiff_t(rank), values.end());
      return values[rank];
    };
    const size_t outside = shown.size() / 100;
    low[axis] = at(outside);
    step[axis] = std::max(at(shown.size() - 1 - outside) - low[axis], 1e-30f) / float((1 << 21) - 1);
  }
  std::vector<std::pair<uint64_t, uint32_t>> keyed(shown.size());
  for (size_t i = 0; i < shown.size(); ++i) {
    uint64_t code = 0;
    for (size_t axis = 0; axis < 3; ++axis) {
      const float cell = (splats.position[3 * size_t(shown[i]) + axis] - low[axis]) / step[axis];
      code |= every_third_bit(uint64_t(std::clamp(cell, 0.0f, float((1 << 21) - 1)))) << axis;
    }
    keyed[i] = {code, shown[i]};
  }
  std::sort(keyed.begin(), keyed.end());
  for (size_t i = 0; i < shown.size(); ++i) shown[i] = keyed[i].second;
  return shown;
}

// The rotation of a quaternion of length 1, row by row.
std::array<float, 9> matrix_of(const float* q) {
  const float w = q[0], x = q[1], y = q[2], z = q[3];
  return {1 - 2 * (y * y + z * z), 2 * (x * y - w * z),     2 * (x * z + w * y),
          2 * (x * y + w * z),     1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
          2 * (x * z - w * y),     2 * (y * z + w * x),     1 - 2 * (x * x + y * y)};
}

}  // namespace

SplatChunks::SplatChunks(const Splats& splats)
    : sh_degree_(splats.sh_degree), is_antialiased_(splats.is_antialiased), order_(order_in_space(splats)) {
  const size_t count = order_.size(), terms = size_t(sh_terms(sh_degree_));
  const size_t chunk_count = divide_up<size_t>(count, kChunkSplats);
  numbers_.assign(chunk_count * kPlanes * kChunkSplats, 0.0f);
  sh_.assign(chunk_count * terms * 3 * kChunkSplats, int16_t(0));
  chunks_.resize(chunk_count);
  for (size_t c = 0; c < chunk_count; ++c) {
    SplatChunk& chunk = chunks_[c];
    const size_t first = c * kChunkSplats;
    chunk.count = uint32_t(std::min<size_t>(kChunkSplats, count - first));
    const float* const planes = numbers_.data() + c * kPlanes * kChunkSplats;
    int16_t* const sh = sh_.data() + c * terms * 3 * kChunkSplats;
    const auto plane = [&](size_t k) { return planes + k * kChunkSplats; };
    for (size_t axis = 0; axis < 3; ++axis) {
      chunk.position[axis] = plane(axis);
      chunk.colour[axis] = plane(kColourPlane + axis);
      float low = splats.position[3 * size_t(order_[first]) + axis], high = low;
      for (size_t i = 0; i < chunk.count; ++i) {
        const float value = splats.position[3 * size_t(order_[first + i]) + axis];
        low = std::min(low, value);
        high = std::max(high, value);
      }
      chunk.centre[axis] = splats.origin[axis] + (double(low) + double(high)) / 2;
    }
    for (size_t k = 0; k < kAxesPlanes; ++k) chunk.axes[k] = plane(3 + k);
    chunk.log_opacity = plane(kOpacityPlane);
    chunk.sh = sh;
    for (size_t i = 0; i < chunk.count; ++i) {
      const size_t from = order_[first + i];
      set(uint32_t(first + i), splat_at(splats, from));
      for (size_t k = 0; k < 3 * terms; ++k) sh[k * kChunkSplats + i] = splats.sh[3 * terms * from + k];
    }
  }
}

void SplatChunks::set(uint32_t place, const Splat& splat) {
  SplatChunk& chunk = chunks_[place / kChunkSplats];
  float* const numbers = numbers_.data() + place / kChunkSplats * kPlanes * kChunkSplats + place % kChunkSplats;
  const auto plane = [&](size_t k) -> float& { return numbers[k * kChunkSplats]; };
  float distance = 0;
  for (size_t axis = 0; axis < 3; ++axis) {
    const auto local = float(splat.position[axis] - chunk.centre[axis]);
    plane(axis) = local;
    distance += local * local;
    plane(kColourPlane + axis) = splat.colour[axis];
  }
  const std::array<float, 3>& scale = splat.scale;
  chunk.radius = std::max(chunk.radius, std::sqrt(distance) + kMaxReach * std::max({scale[0], scale[1], scale[2]}));
  const std::array<float, 9> rotation = matrix_of(splat.rotation.data());
  for (size_t k = 0; k < kAxesPlanes; ++k) plane(3 + k) = rotation[k] * scale[k % 3];
  plane(kOpacityPlane) = std::log(splat.opacity);
}

}  // namespace maq
