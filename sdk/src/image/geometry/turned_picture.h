// Rendered pictures, turned and moved.
#pragma once

#include <array>
#include <cstdint>

namespace maq {

// A picture of values that lie side by side, row by row without padding.
template <class Value>
struct Raster {
  Value* pixels = nullptr;
  int width_px = 0, height_px = 0;
};

// Rows [top, bottom) of `to`: each pixel (x, y) is that of `from` at (b[0] x + b[1] y + b[2], b[3] x + b[4] y + b[5]) of
// `back`, beyond the border the last one. `channels` is 1 or 3.
// Bilinear. Not by OpenCV, which before its version 5 rounds places to 1/32 of a pixel: an error that is seen where a picture
// has edges.
void turn_bytes(const Raster<const uint8_t>& from, int channels, const std::array<double, 6>& back,
                const Raster<uint8_t>& to, int top, int bottom);
// The nearest, since between two depths there need not be anything.
void turn_depths(const Raster<const float>& from, const std::array<double, 6>& back, const Raster<float>& to, int top,
                 int bottom);

}  // namespace maq
