#include "image/geometry/turned_photo.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"

namespace maq {
namespace {

// The two pixels that a coordinate is between, and how far it is to the second.
struct Between {
  int first, second;
  float share;
};

inline Between between(double at, int size) {
  const double last = size - 1;
  const double clamped = at >= 0 ? (at <= last ? at : last) : 0;
  const int first = int(clamped);
  return {first, std::min(first + 1, size - 1), float(clamped - first)};
}

}  // namespace

void turn_photo(const ImageView& photo, const std::array<double, 6>& back, int width_px, int height_px,
                std::vector<float>& rgb) {
  if (photo.format != MAQ_PIXEL_BGR8) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "A photo in ", pixel_format_name(photo.format),
                " cannot be turned; it must be BGR.");
  }
  rgb.resize(size_t(width_px) * size_t(height_px) * 3);
  const uint8_t* pixels = photo.planes[0].data;
  const auto stride = size_t(photo.planes[0].stride_bytes);
  float* to = rgb.data();
  for (int row = 0; row < height_px; ++row) {
    const double row_x = back[1] * row + back[2], row_y = back[4] * row + back[5];
    for (int column = 0; column < width_px; ++column, to += 3) {
      const Between x = between(back[0] * column + row_x, photo.width_px);
      const Between y = between(back[3] * column + row_y, photo.height_px);
      const uint8_t* above = pixels + size_t(y.first) * stride;
      const uint8_t* below = pixels + size_t(y.second) * stride;
      const size_t left = 3 * size_t(x.first), right = 3 * size_t(x.second);
      for (size_t colour = 0; colour < 3; ++colour) {
        const float a = above[left + colour], b = above[right + colour];
        const float c = below[left + colour], d = below[right + colour];
        const float upper = a + x.share * (b - a), lower = c + x.share * (d - c);
        to[2 - colour] = (upper + y.share * (lower - upper)) * (1.0f / 255);
      }
    }
  }
}

}  // namespace maq
