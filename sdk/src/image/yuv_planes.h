// Images in planes of Y, U and V (YUV_420_888: Android's cameras and video decoders) as NV12 frames.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

namespace maq {

// The values of a row lie `pixel_stride` bytes apart, the rows `row_stride`; the last row may end with its last value.
struct YuvPlane {
  const uint8_t* data = nullptr;
  size_t bytes = 0;
  int32_t row_stride = 0;
  int32_t pixel_stride = 0;
};

// Y in full size, U and V of every second row and column. U and V may be planes of their own, or share one in which
// their values take turns, in either order.
struct YuvImage {
  int32_t width_px = 0;
  int32_t height_px = 0;
  YuvPlane planes[3];
  bool is_full_range = true;  // all values from 0 to 255 (JFIF, BT.601), or the video range
};

// Returns the reason why the planes do not fit an image of that size; nothing if they fit.
std::optional<std::string> yuv_image_problem(const YuvImage& image);

// Writes the image, rotated by 90 degrees clockwise so often (0 to 3), as NV12 without padding, packed_bytes() long, in
// the video range that frames promise: 16 to 235 of Y and 16 to 240 of U and V.
void yuv_to_nv12(const YuvImage& image, int quarter_turns, uint8_t* nv12);

}  // namespace maq
