// Resizes images of bytes, to the bit as OpenCV's resize.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/frame.h"

namespace maq {

// Pixels of 1, 3 or 4 bytes that lie side by side in rows.
template <class Byte>
struct BytePicture {
  Byte* pixels = nullptr;
  size_t stride_bytes = 0;
  int width_px = 0, height_px = 0;
  int channels = 0;
};

// Scales `from` to the size of `to`, which has as many channels. The mean of the area that each pixel covers where
// neither side grows (INTER_AREA), bilinear otherwise (INTER_LINEAR).
void resize(const BytePicture<const uint8_t>& from, const BytePicture<uint8_t>& to);

// The image of `from` in any format as `to`, in BGR, of that size.
void resize_to_bgr(const ImageView& from, int width_px, int height_px, Frame& to);

// The BGR image `image` as `frame` of that smaller size. Throws MAQ_ERROR_INVALID_ARGUMENT unless `image` is BGR and
// no smaller.
void shrink(const ImageView& image, int width_px, int height_px, Frame& frame);

// Shrinks a validity mask (row by row, 0: not valid): pixels are valid where all that they cover are.
void shrink_valid(std::vector<uint8_t>& valid, int from_width_px, int from_height_px, int width_px, int height_px);

}  // namespace maq
