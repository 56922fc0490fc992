#include "image/geometry/turned_picture.h"

#include <algorithm>
#include <cstddef>

namespace maq {
namespace {

constexpr int kBits = 11;  // of a weight: two of them and a byte are less than 31 bits
constexpr int kOne = 1 << kBits;

// The pixel at or before a coordinate, the next one, and the weight of that.
struct Between {
  size_t first, second;
  int weight;
};

inline Between between(double at, int size) {
  const double clamped = std::min(std::max(at, 0.0), double(size - 1));
  const int first = int(clamped);
  return {size_t(first), size_t(std::min(first + 1, size - 1)), int((clamped - first) * kOne + 0.5)};
}

template <size_t channels>
void turn(const Raster<const uint8_t>& from, const std::array<double, 6>& back, const Raster<uint8_t>& to, int top,
          int bottom) {
  const size_t stride = size_t(from.width_px) * channels;
  for (int row = top; row < bottom; ++row) {
    const double row_x = back[1] * row + back[2], row_y = back[4] * row + back[5];
    uint8_t* pixel = to.pixels + size_t(row) * size_t(to.width_px) * channels;
    for (int column = 0; column < to.width_px; ++column, pixel += channels) {
      const Between x = between(back[0] * column + row_x, from.width_px);
      const Between y = between(back[3] * column + row_y, from.height_px);
      const uint8_t* const above = from.pixels + y.first * stride;
      const uint8_t* const below = from.pixels + y.second * stride;
      const size_t left = x.first * channels, right = x.second * channels;
      for (size_t c = 0; c < channels; ++c) {
        const int upper = above[left + c] * (kOne - x.weight) + above[right + c] * x.weight;
        const int lower = below[left + c] * (kOne - x.weight) + below[right + c] * x.weight;
        pixel[c] = uint8_t((upper * (kOne - y.weight) + lower * y.weight + (1 << (2 * kBits - 1))) >> (2 * kBits));
      }
    }
  }
}

}  // namespace

void turn_bytes(const Raster<const uint8_t>& from, int channels, const std::array<double, 6>& back,
                const Raster<uint8_t>& to, int top, int bottom) {
  if (channels == 3) {
    turn<3>(from, back, to, top, bottom);
  } else {
    turn<1>(from, back, to, top, bottom);
  }
}

void turn_depths(const Raster<const float>& from, const std::array<double, 6>& back, const Raster<float>& to, int top,
                 int bottom) {
  for (int row = top; row < bottom; ++row) {
    for (int column = 0; column < to.width_px; ++column) {
      const double x = back[0] * column + back[1] * row + back[2] + 0.5;
      const double y = back[3] * column + back[4] * row + back[5] + 0.5;
      const int at_x = int(std::min(std::max(x, 0.0), from.width_px - 1.0));
      const int at_y = int(std::min(std::max(y, 0.0), from.height_px - 1.0));
      to.pixels[size_t(row) * size_t(to.width_px) + size_t(column)] =
          from.pixels[size_t(at_y) * size_t(from.width_px) + size_t(at_x)];
    }
  }
}

}  // namespace maq
