// Images of Android's cameras (YUV_420_888) as NV12 frames.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

namespace maq {

// A plane as AImage describes it: the values of a row lie `pixel_stride` bytes apart, the rows `row_stride`.
struct Camera2Plane {
  const uint8_t* data = nullptr;
  int bytes = 0;
  int32_t row_stride = 0;
  int32_t pixel_stride = 0;
};

// Y in full size, U and V of every second row and column. U and V may be planes of their own, or share one in which
// their values take turns, in either order.
struct Camera2Image {
  int32_t width_px = 0;
  int32_t height_px = 0;
  Camera2Plane planes[3];
};

// Why the planes are not those of an image of that size; nothing when they are.
std::optional<std::string> camera2_image_problem(const Camera2Image& image);

// Writes the image, rotated by 90 degrees clockwise so often (0 to 3), as NV12 without padding, packed_bytes() long.
// Android's pixels use all values from 0 to 255 (its
// data space JFIF, BT.601); frames promise the video range, 16 to 235 of Y and 16 to 240 of U and V.
void camera2_to_nv12(const Camera2Image& image, int quarter_turns, uint8_t* nv12);

}  // namespace maq
