// The planes of a frame, whatever its format, as values that all calculations treat alike.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/frame.h"

namespace maq {

// A plane of values in a frame: `channels` bytes, `channel_bytes` apart, of each of width x height pixels that lie
// `pixel_bytes` apart; a pixel of it is `subsampled` pixels of the frame wide or high.
struct PlaneSamples {
  const uint8_t* from;
  size_t from_stride;
  uint8_t* to;
  size_t to_stride;
  int width, height;
  int channels, channel_bytes, pixel_bytes;
  int subsampled_x, subsampled_y;
};

// The planes of an image, to be written to packed memory of its format and size: at most two, whose number is returned.
// A picture in YUV has its brightness in the first, and colours in the second.
int plane_samples(const ImageView& image, uint8_t* pixels, PlaneSamples* all);

}  // namespace maq
