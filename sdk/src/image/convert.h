// Between pixel formats.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/frame.h"

namespace maq {

// The image as BGR8: of the same memory when it is BGR8 already, otherwise a converted copy in `memory`, which the
// caller keeps so that the next image takes nothing from the heap. YUV is BT.601 in video range, in the fixed-point
// arithmetic of OpenCV's cvtColor. Throws MAQ_ERROR_UNSUPPORTED for a depth image.
ImageView as_bgr(const ImageView& image, std::vector<uint8_t>& memory);

// From one row of a caller's memory to the next: `stride_bytes`, or of rows without padding where that is 0. Throws
// MAQ_ERROR_INVALID_ARGUMENT when it is too short for a row, or `size_bytes` for all.
size_t checked_stride(maq_pixel_format format, int width_px, int height_px, size_t stride_bytes, size_t size_bytes);

// Writes the image to `pixels` in `format` (RGB8, BGR8, RGBA8 or GREY8); `stride_bytes` 0 means rows without padding.
// Throws MAQ_ERROR_UNSUPPORTED for other formats, MAQ_ERROR_INVALID_ARGUMENT when `size_bytes` is too small.
void copy_pixels(const ImageView& image, maq_pixel_format format, uint8_t* pixels, size_t stride_bytes,
                 size_t size_bytes);

}  // namespace maq
