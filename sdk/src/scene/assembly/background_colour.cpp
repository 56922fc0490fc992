#include "scene/assembly/background_colour.h"

#include <vector>

namespace maq {

void BackgroundColour::add(const ImageView& photo, const uint8_t* valid, const ZBuffer& seen) {
  const int columns = (seen.width_px() + kBlockPx - 1) / kBlockPx, rows = (seen.height_px() + kBlockPx - 1) / kBlockPx;
  std::vector<uint8_t> has_point(size_t(columns) * size_t(rows), 0);
  for (int y = 0; y < seen.height_px(); ++y) {
    const DepthKey* const keys = seen.keys() + size_t(y) * size_t(seen.width_px());
    uint8_t* const blocks = has_point.data() + size_t(y / kBlockPx) * size_t(columns);
    for (int x = 0; x < seen.width_px(); ++x) {
      if (keys[x] != kNoPointKey) blocks[x / kBlockPx] = 1;
    }
  }
  std::vector<int> block_of(size_t(photo.width_px));
  for (int x = 0; x < photo.width_px; ++x) {
    block_of[size_t(x)] = int(int64_t(x) * seen.width_px() / photo.width_px) / kBlockPx;
  }
  for (int y = 0; y < photo.height_px; ++y) {
    const uint8_t* const pixels = photo.planes[0].data + size_t(y) * photo.planes[0].stride_bytes;
    const uint8_t* const blocks =
        has_point.data() + size_t(int64_t(y) * seen.height_px() / photo.height_px / kBlockPx) * size_t(columns);
    // Bytes of a row, summed exactly.
    uint64_t sums[2][3] = {}, counts[2] = {};
    for (int x = 0; x < photo.width_px; ++x) {
      if (valid != nullptr && valid[size_t(y) * size_t(photo.width_px) + size_t(x)] == 0) continue;
      const uint8_t has = blocks[block_of[size_t(x)]];
      for (size_t c = 0; c < 3; ++c) sums[has][c] += pixels[3 * x + int(c)];
      ++counts[has];
    }
    for (size_t c = 0; c < 3; ++c) {
      background_.colour[2 - c] += double(sums[0][c]) / 255;
      all_.colour[2 - c] += double(sums[0][c] + sums[1][c]) / 255;
    }
    background_.count += double(counts[0]);
    all_.count += double(counts[0] + counts[1]);
  }
}

void BackgroundColour::add(const BackgroundColour& other) {
  for (size_t c = 0; c < 3; ++c) {
    background_.colour[c] += other.background_.colour[c];
    all_.colour[c] += other.all_.colour[c];
  }
  background_.count += other.background_.count;
  all_.count += other.all_.count;
}

std::array<float, 3> BackgroundColour::mean() const {
  const Sum& sum = background_.count > 0 ? background_ : all_;
  std::array<float, 3> colour = {0, 0, 0};
  for (size_t c = 0; c < 3 && sum.count > 0; ++c) colour[c] = float(sum.colour[c] / sum.count);
  return colour;
}

}  // namespace maq
