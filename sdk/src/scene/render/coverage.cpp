#include "scene/render/coverage.h"

#include <algorithm>

#include "core/simd_clones.h"

namespace maq {
namespace {

constexpr int kCoarsest = DescriptorRaster::kLevels - 1;
constexpr uint8_t kConfidence[DescriptorRaster::kLevels] = {255, 255, 255, 128, 64};

// One row of a level, `width` pixels, from the next coarser one's rows: that which it is in and the nearest beside it.
MAQ_SIMD_CLONES void alpha_row(const DepthKey* __restrict keys, size_t width, uint8_t confidence,
                               const uint8_t* __restrict in, const uint8_t* __restrict beside,
                               uint16_t* __restrict blended, uint8_t* __restrict alphas) {
  const size_t half = width / 2;
  // With one more at each end, the border repeated.
  for (size_t i = 0; i < half; ++i) blended[i + 1] = uint16_t(3 * in[i] + beside[i]);
  blended[0] = blended[1];
  blended[half + 1] = blended[half];
  for (size_t i = 0; i < half; ++i) {
    const int left = (3 * blended[i + 1] + blended[i] + 8) >> 4;
    const int right = (3 * blended[i + 1] + blended[i + 2] + 8) >> 4;
    alphas[2 * i] = uint8_t(std::max(left, keys[2 * i] == kNoPointKey ? 0 : int(confidence)));
    alphas[2 * i + 1] = uint8_t(std::max(right, keys[2 * i + 1] == kNoPointKey ? 0 : int(confidence)));
  }
}

MAQ_SIMD_CLONES void depth_row(const DepthKey* __restrict keys, size_t width, const float* __restrict coarser,
                               float* __restrict depths) {
  for (size_t i = 0; i < width; ++i) depths[i] = keys[i] == kNoPointKey ? coarser[i / 2] : depth_of(keys[i]);
}

}  // namespace

void Coverage::find(const DescriptorRaster& raster, int width_px, int height_px, WorkerThreads& threads) {
  rows_.resize(size_t(threads.count()));
  for (std::vector<uint16_t>& row : rows_) row.resize(size_t(width_px / 2) + 2);
  for (int level = kCoarsest; level >= 0; --level) {
    const size_t width = size_t(width_px) >> level, height = size_t(height_px) >> level;
    const DepthKey* const keys = raster.keys(level);
    std::vector<uint8_t>& alphas = alphas_[level];
    std::vector<float>& depths = depths_[level];
    alphas.resize(width * height);
    depths.resize(width * height);
    if (level == kCoarsest) {
      for (size_t i = 0; i < alphas.size(); ++i) {
        alphas[i] = keys[i] == kNoPointKey ? 0 : kConfidence[level];
        depths[i] = keys[i] == kNoPointKey ? 0 : depth_of(keys[i]);
      }
      continue;
    }
    const uint8_t* const coarser = alphas_[level + 1].data();
    const size_t half = width / 2;
    constexpr size_t kRowsAtOnce = 32;
    threads.run((height + kRowsAtOnce - 1) / kRowsAtOnce, [&](size_t strip, int worker) {
      for (size_t y = strip * kRowsAtOnce; y < std::min(height, (strip + 1) * kRowsAtOnce); ++y) {
        const size_t in = y / 2, last = height / 2 - 1;
        const size_t beside = y % 2 == 0 ? (in == 0 ? 0 : in - 1) : std::min(in + 1, last);
        alpha_row(keys + y * width, width, kConfidence[level], coarser + in * half, coarser + beside * half,
                  rows_[size_t(worker)].data(), alphas.data() + y * width);
        depth_row(keys + y * width, width, depths_[level + 1].data() + in * half, depths.data() + y * width);
      }
    });
  }
}

}  // namespace maq
