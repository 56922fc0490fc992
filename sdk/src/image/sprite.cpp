#include "image/sprite.h"

#include <algorithm>

#include "image/geometry/resize.h"

namespace maq {

BgraImage crop_sprite(const BgraImage& sheet, int x, int y, int width, int height, int to_width, int to_height,
                      bool mirrored) {
  // Multiplied before scaling: otherwise the colour of transparent pixels bleeds into the edges.
  std::vector<uint8_t> tile;
  tile.reserve(size_t(width) * size_t(height) * 4);
  for (int row = y; row < y + height; ++row) {
    const uint8_t* pixel = sheet.pixels.data() + (size_t(row) * size_t(sheet.width_px) + size_t(x)) * 4;
    for (int col = 0; col < width; ++col, pixel += 4) {
      for (int c = 0; c < 3; ++c) tile.push_back(uint8_t((pixel[c] * pixel[3] + 127) / 255));
      tile.push_back(pixel[3]);
    }
  }
  const size_t stride = size_t(to_width) * 4;
  BgraImage sprite{to_width, to_height, std::vector<uint8_t>(stride * size_t(to_height))};
  resize({tile.data(), size_t(width) * 4, width, height, 4}, {sprite.pixels.data(), stride, to_width, to_height, 4});
  if (!mirrored) return sprite;
  for (int row = 0; row < to_height; ++row) {
    uint8_t* const pixels = sprite.pixels.data() + size_t(row) * stride;
    for (int left = 0, right = to_width - 1; left < right; ++left, --right) {
      std::swap_ranges(pixels + 4 * left, pixels + 4 * left + 4, pixels + 4 * right);
    }
  }
  return sprite;
}

void draw_sprite(const BgraImage& sprite, int x, int y, Frame& frame) {
  const int first_col = std::max(0, -x);
  const int last_col = std::min(sprite.width_px, frame.image.width_px - x);
  const int first_row = std::max(0, -y);
  const int last_row = std::min(sprite.height_px, frame.image.height_px - y);
  for (int row = first_row; row < last_row; ++row) {
    const uint8_t* from = sprite.pixels.data() + (size_t(row) * size_t(sprite.width_px) + size_t(first_col)) * 4;
    uint8_t* to = frame.storage.data() + (size_t(y + row) * size_t(frame.image.width_px) + size_t(x + first_col)) * 3;
    for (int col = first_col; col < last_col; ++col, from += 4, to += 3) {
      const int behind = 255 - from[3];
      for (int c = 0; c < 3; ++c) to[c] = uint8_t(std::min(255, from[c] + (to[c] * behind + 127) / 255));
    }
  }
}

}  // namespace maq
