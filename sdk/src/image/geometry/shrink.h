// Smaller copies of photos and of what is valid in them.
#pragma once

#include <cstdint>
#include <vector>

#include "core/frame.h"

namespace maq {

// The BGR picture `image` as `frame` of that smaller size: each pixel is the mean of those that it covers. Throws
// MAQ_ERROR_INVALID_ARGUMENT unless `image` is BGR and no smaller.
void shrink(const ImageView& image, int width_px, int height_px, Frame& frame);

// `valid` (row by row, 0: not) likewise: pixels are valid where all are that they cover.
void shrink_valid(std::vector<uint8_t>& valid, int from_width_px, int from_height_px, int width_px, int height_px);

}  // namespace maq
