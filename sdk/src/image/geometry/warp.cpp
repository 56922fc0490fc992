#include "image/geometry/warp.h"

#include <algorithm>
#include <cstddef>

#include "core/error.h"

namespace maq {
namespace {

// The pixel at or before a coordinate, the next one, and how far it is to that.
struct Neighbours {
  int first, second;
  double fraction;
};

inline Neighbours neighbours(double at, int size) {
  const double last = size - 1;
  const double clamped = at >= 0 ? (at <= last ? at : last) : 0;  // 0 also for NaN
  const int first = int(clamped);
  return {first, std::min(first + 1, size - 1), clamped - first};
}

// --- bytes: weights of so many fractional bits; two of them and a byte are less than 31 bits
// ---------------------------

constexpr int kWeightBits = 11;
constexpr int kOne = 1 << kWeightBits;

inline int weight_of(double fraction) { return int(fraction * kOne + 0.5); }

template <size_t channels>
void warp(const Raster<const uint8_t>& from, const PixelMap& to_source, const Raster<uint8_t>& to, int top,
          int bottom) {
  const size_t stride = size_t(from.width_px) * channels;
  for (int row = top; row < bottom; ++row) {
    const double row_x = to_source[1] * row + to_source[2], row_y = to_source[4] * row + to_source[5];
    uint8_t* pixel = to.pixels + size_t(row) * size_t(to.width_px) * channels;
    for (int column = 0; column < to.width_px; ++column, pixel += channels) {
      const Neighbours x = neighbours(to_source[0] * column + row_x, from.width_px);
      const Neighbours y = neighbours(to_source[3] * column + row_y, from.height_px);
      const int weight_x = weight_of(x.fraction), weight_y = weight_of(y.fraction);
      const uint8_t* const upper_row = from.pixels + size_t(y.first) * stride;
      const uint8_t* const lower_row = from.pixels + size_t(y.second) * stride;
      const size_t left = size_t(x.first) * channels, right = size_t(x.second) * channels;
      for (size_t c = 0; c < channels; ++c) {
        const int upper = upper_row[left + c] * (kOne - weight_x) + upper_row[right + c] * weight_x;
        const int lower = lower_row[left + c] * (kOne - weight_x) + lower_row[right + c] * weight_x;
        constexpr int kHalf = 1 << (2 * kWeightBits - 1);
        pixel[c] = uint8_t((upper * (kOne - weight_y) + lower * weight_y + kHalf) >> (2 * kWeightBits));
      }
    }
  }
}

}  // namespace

void warp_to_rgb(const ImageView& photo, const PixelMap& to_source, int width_px, int height_px,
                 std::vector<float>& rgb) {
  if (photo.format != MAQ_PIXEL_BGR8) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "A photo in ", pixel_format_name(photo.format),
                " cannot be warped; it must be BGR.");
  }
  rgb.resize(size_t(width_px) * size_t(height_px) * 3);
  const uint8_t* pixels = photo.planes[0].data;
  const size_t stride = photo.planes[0].stride_bytes;
  float* to = rgb.data();
  for (int row = 0; row < height_px; ++row) {
    const double row_x = to_source[1] * row + to_source[2], row_y = to_source[4] * row + to_source[5];
    for (int column = 0; column < width_px; ++column, to += 3) {
      const Neighbours x = neighbours(to_source[0] * column + row_x, photo.width_px);
      const Neighbours y = neighbours(to_source[3] * column + row_y, photo.height_px);
      const float fraction_x = float(x.fraction), fraction_y = float(y.fraction);
      const uint8_t* const upper_row = pixels + size_t(y.first) * stride;
      const uint8_t* const lower_row = pixels + size_t(y.second) * stride;
      const size_t left = 3 * size_t(x.first), right = 3 * size_t(x.second);
      for (size_t c = 0; c < 3; ++c) {
        const float a = upper_row[left + c], b = upper_row[right + c];
        const float d = lower_row[left + c], e = lower_row[right + c];
        const float upper = a + fraction_x * (b - a), lower = d + fraction_x * (e - d);
        to[2 - c] = (upper + fraction_y * (lower - upper)) * (1.0f / 255);
      }
    }
  }
}

void warp_bytes(const Raster<const uint8_t>& from, int channels, const PixelMap& to_source, const Raster<uint8_t>& to,
                int top, int bottom) {
  if (channels == 3) {
    warp<3>(from, to_source, to, top, bottom);
  } else {
    warp<1>(from, to_source, to, top, bottom);
  }
}

void warp_depths(const Raster<const float>& from, const PixelMap& to_source, const Raster<float>& to, int top,
                 int bottom) {
  for (int row = top; row < bottom; ++row) {
    for (int column = 0; column < to.width_px; ++column) {
      const double x = to_source[0] * column + to_source[1] * row + to_source[2] + 0.5;
      const double y = to_source[3] * column + to_source[4] * row + to_source[5] + 0.5;
      const int at_x = int(std::min(std::max(x, 0.0), from.width_px - 1.0));
      const int at_y = int(std::min(std::max(y, 0.0), from.height_px - 1.0));
      to.pixels[size_t(row) * size_t(to.width_px) + size_t(column)] =
          from.pixels[size_t(at_y) * size_t(from.width_px) + size_t(at_x)];
    }
  }
}

}  // namespace maq
