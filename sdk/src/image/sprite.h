// Crops sprites from a sheet and draws them into a frame.
#pragma once

#include <cstdint>
#include <vector>

#include "core/frame.h"

namespace maq {

// An image with alpha, 4 bytes a pixel in the order B, G, R, A, rows without padding.
struct BgraImage {
  int width_px = 0;
  int height_px = 0;
  std::vector<uint8_t> pixels;
};

// The part of `sheet` at (x, y), scaled to `to_width` x `to_height` and mirrored left to right if asked.
// Its colours come out multiplied by alpha, as draw_sprite wants them.
BgraImage crop_sprite(const BgraImage& sheet, int x, int y, int width, int height, int to_width, int to_height,
                      bool mirrored);

// Draws a sprite with its top left corner at (x, y) over a BGR frame; clipped to the frame.
void draw_sprite(const BgraImage& sprite, int x, int y, Frame& frame);

}  // namespace maq
