// Views the planes of a frame of any format as strided byte values.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/frame.h"

namespace maq {

// One plane of width x height pixels. Pixels are `pixel_bytes` apart; each has `channels` bytes, `channel_bytes` apart,
// and covers subsampled_x x subsampled_y frame pixels.
struct PlaneSamples {
  const uint8_t* from;
  size_t from_stride;
  uint8_t* to;
  size_t to_stride;
  int width, height;
  int channels, channel_bytes, pixel_bytes;
  int subsampled_x, subsampled_y;
};

// Fills `all` with the planes of an image, to be written to packed memory of the same format and size. Returns their
// number, at most two. YUV images have luma in the first plane and chroma in the second.
int plane_samples(const ImageView& image, uint8_t* pixels, PlaneSamples* all);

}  // namespace maq
