// Cutting sprites from a sheet and drawing them into a frame.
#pragma once

#include "core/frame.h"
#include "image/image_file.h"

namespace maq {

// The part of `sheet` at (x, y), scaled to `to_width` x `to_height` and mirrored left to right if asked.
// Its colours come out multiplied by alpha, as draw_sprite wants them.
BgraImage cut_sprite(const BgraImage& sheet, int x, int y, int width, int height, int to_width, int to_height,
                     bool mirrored);

// Draws a sprite with its top left corner at (x, y) over a BGR frame; what lies outside is cut off.
void draw_sprite(const BgraImage& sprite, int x, int y, Frame& frame);

}  // namespace maq
