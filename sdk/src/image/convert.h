// Between pixel formats and sizes.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/frame.h"

namespace maq {

// Writes the image to `pixels` in `format` (RGB8, BGR8, RGBA8 or GREY8); `stride_bytes` 0 means rows without padding.
// Throws MAQ_ERROR_UNSUPPORTED for other formats, MAQ_ERROR_INVALID_ARGUMENT when `size_bytes` is too little.
void copy_pixels(const ImageView& image, maq_pixel_format format, uint8_t* pixels, size_t stride_bytes,
                 size_t size_bytes);

// Scales the image of `from` into `to`, as BGR: area averages when shrinking both ways, bilinear otherwise.
void resize_to_bgr(const ImageView& from, int width_px, int height_px, Frame& to);

}  // namespace maq
