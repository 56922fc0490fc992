#include "scene/render/refined_image.h"

#include <algorithm>

#include "core/simd_clones.h"

namespace maq {
namespace {

constexpr size_t kColourChannels = 3;

MAQ_SIMD_CLONES void to_bytes(const float* __restrict values, size_t count, uint8_t* __restrict bytes) {
  for (size_t i = 0; i < count; ++i) {
    const float above = values[i] > 0 ? values[i] : 0;  // also where it is NaN
    bytes[i] = uint8_t(int(std::min(above, 1.0f) * 255 + 0.5f));
  }
}

inline uint8_t over(uint8_t colour, uint8_t background, uint8_t alpha) {
  return uint8_t((colour * alpha + background * (255 - alpha) + 127) / 255);
}

}  // namespace

void RefinedImage::write(const float* refined, const RefinerLayout& layout, const RasterWindow& window,
                         const uint8_t* alphas, const float* depths, const std::array<uint8_t, 3>& background,
                         int confidence_gain, const ImageRows& to, WorkerThreads& threads) {
  const size_t width = size_t(window.width_px);
  bytes_.resize(size_t(threads.count()));
  for (std::vector<uint8_t>& bytes : bytes_) bytes.resize(2 * width * kColourChannels);
  const int rows = std::min(window.height_px, to.rows - window.top_px);
  const size_t columns = size_t(std::max(0, std::min(window.width_px, to.columns - window.left_px)));
  // From one of two pixels of a row to the other, from one pair to the next, and from the first row's to the second's.
  const size_t beside = kColourChannels, pair = layout.is_space_to_depth ? 4 * kColourChannels : 2 * kColourChannels;
  const size_t below = layout.is_space_to_depth ? 2 * kColourChannels : width * kColourChannels;
  constexpr int kRowsAtOnce = 32;
  threads.run(size_t(std::max(0, (rows + kRowsAtOnce - 1) / kRowsAtOnce)), [&](size_t strip, int worker) {
    uint8_t* const bytes = bytes_[size_t(worker)].data();
    const int end = std::min(rows, int(strip + 1) * kRowsAtOnce);
    for (int y = int(strip) * kRowsAtOnce; y < end; ++y) {
      if (y % 2 == 0) to_bytes(refined + size_t(y) * width * kColourChannels, 2 * width * kColourChannels, bytes);
      const uint8_t* const from = bytes + size_t(y % 2) * below;
      const size_t first = size_t(window.top_px + y) * size_t(to.columns) + size_t(window.left_px);
      uint8_t* const bgr = to.bgr + first * kColourChannels;
      const uint8_t* const alpha = alphas + size_t(y) * width;
      for (size_t x = 0; x < columns; ++x) {
        const uint8_t* const rgb = from + x / 2 * pair + x % 2 * beside;
        const auto opacity = uint8_t(std::min(255, confidence_gain * alpha[x]));
        for (size_t c = 0; c < kColourChannels; ++c)
          bgr[x * kColourChannels + c] = over(rgb[2 - c], background[c], opacity);
      }
      std::copy_n(alpha, columns, to.alpha + first);
      std::copy_n(depths + size_t(y) * width, columns, to.depth + first);
    }
  });
}

}  // namespace maq
