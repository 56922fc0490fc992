// Images rotated, moved or scaled by an affine map, bilinear.
//
// Not by OpenCV's warpAffine, which before its version 5 rounds positions to 1/32 of a pixel: a visible error at edges,
// and another error than in the training data. Beyond the border the last pixels are repeated.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/frame.h"

namespace maq {

// Takes a pixel of one image to another image's: x' = m[0] x + m[1] y + m[2], y' = m[3] x + m[4] y + m[5].
using PixelMap = std::array<double, 6>;

// Rows of pixels without padding.
template <class Value>
struct Raster {
  Value* pixels = nullptr;
  int width_px = 0, height_px = 0;
};

// Each pixel of the result is the one of the source to which `to_source` takes it. `photo` (BGR) as floats for a
// network, into `rgb` [height_px][width_px][3], in 0..1. Throws MAQ_ERROR_INVALID_ARGUMENT unless `photo` is BGR.
void warp_to_rgb(const ImageView& photo, const PixelMap& to_source, int width_px, int height_px,
                 std::vector<float>& rgb);

// Rows [top, bottom) of `to`, so that several threads can share an image. `channels` is 1 or 3.
void warp_bytes(const Raster<const uint8_t>& from, int channels, const PixelMap& to_source, const Raster<uint8_t>& to,
                int top, int bottom);
// The same with the nearest pixel: there need not be a surface between two depths.
void warp_depths(const Raster<const float>& from, const PixelMap& to_source, const Raster<float>& to, int top,
                 int bottom);

}  // namespace maq
