// A smooth texture, known at any point, that moves through frames of any format: where it is can be told to hundredths
// of a pixel.
#pragma once

#include <cmath>
#include <vector>

#include "core/frame.h"

namespace moving_texture {

// 0 to 255; waves of 15 to 60 pixels.
inline double brightness(double x, double y) {
  return 128 + 40 * std::sin(x * 0.21 + y * 0.05) + 30 * std::sin(y * 0.17 - x * 0.07) +
         25 * std::sin(0.11 * x + 0.31 * y + 1) + 20 * std::sin(0.33 * x - 0.12 * y + 2);
}

// The texture moved by (x, y), in grey or in colours that lie apart.
inline maq::Frame frame(maq_pixel_format format, int width, int height, double x, double y, int64_t timestamp_ns = 0) {
  maq::Frame made;
  uint8_t* const pixels = made.allocate(format, width, height);
  const auto value = [&](double column, double row) { return uint8_t(std::lround(brightness(column - x, row - y))); };
  const auto put = [&](int plane, int row, size_t byte, uint8_t to) {
    const size_t begin = size_t(made.image.planes[plane].data - pixels);
    pixels[begin + size_t(row) * made.image.planes[plane].stride_bytes + byte] = to;
  };
  for (int row = 0; row < height; ++row) {
    for (int column = 0; column < width; ++column) {
      const size_t at = size_t(column);
      switch (format) {
        case MAQ_PIXEL_GREY8:
        case MAQ_PIXEL_NV12: put(0, row, at, value(column, row)); break;
        case MAQ_PIXEL_YUYV: put(0, row, 2 * at, value(column, row)); break;
        default:
          for (size_t i = 0; i < (format == MAQ_PIXEL_RGBA8 ? 4u : 3u); ++i) {
            put(0, row, at * (format == MAQ_PIXEL_RGBA8 ? 4 : 3) + i, value(column + 9 * double(i), row));
          }
      }
    }
  }
  if (format == MAQ_PIXEL_NV12 || format == MAQ_PIXEL_YUYV) {
    for (int row = 0; row < (format == MAQ_PIXEL_NV12 ? (height + 1) / 2 : height); ++row) {
      const double down = format == MAQ_PIXEL_NV12 ? 2 * row + 0.5 : row;
      for (int column = 0; column < (width + 1) / 2; ++column) {
        for (int i = 0; i < 2; ++i) {
          const uint8_t chroma = value(2 * column + 0.5 + 15 * i, down);
          if (format == MAQ_PIXEL_NV12) {
            put(1, row, size_t(2 * column + i), chroma);
          } else {
            put(0, row, size_t(4 * column + 1 + 2 * i), chroma);
          }
        }
      }
    }
  }
  made.timestamp_ns = timestamp_ns;
  return made;
}

// How far, in pixels, the texture in a part of a grey or NV12 frame is from where it is said to be: by the gradients
// there.
inline double error_px(const maq::Frame& found, double x, double y, int left, int top, int side) {
  double xx = 0, xy = 0, yy = 0, to_x = 0, to_y = 0;
  for (int row = top; row < top + side; ++row) {
    for (int column = left; column < left + side; ++column) {
      const double u = column - x, v = row - y;
      const double dx = (brightness(u + 0.5, v) - brightness(u - 0.5, v)),
                   dy = (brightness(u, v + 0.5) - brightness(u, v - 0.5));
      const double difference =
          found.image.planes[0].data[size_t(row) * found.image.planes[0].stride_bytes + size_t(column)] -
          brightness(u, v);
      xx += dx * dx;
      xy += dx * dy;
      yy += dy * dy;
      to_x += dx * difference;
      to_y += dy * difference;
    }
  }
  const double determinant = xx * yy - xy * xy;
  return std::hypot((yy * to_x - xy * to_y) / determinant, (xx * to_y - xy * to_x) / determinant);
}

// The largest of the parts of a frame that lie `margin` from its edges.
inline double worst_error_px(const maq::Frame& found, double x, double y, int margin) {
  constexpr int kSide = 40;
  double worst = 0;
  for (int top = margin; top + kSide <= found.image.height_px - margin; top += kSide) {
    for (int left = margin; left + kSide <= found.image.width_px - margin; left += kSide) {
      worst = std::max(worst, error_px(found, x, y, left, top, kSide));
    }
  }
  return worst;
}

}  // namespace moving_texture
