// A smooth texture, known at any point, that moves through frames of any format: where it is can be told to hundredths
// of a pixel.
#pragma once

#include <cmath>
#include <iterator>
#include <vector>

#include "core/frame.h"

namespace moving_texture {

struct Wave {
  double amplitude, x, y, phase;
};

inline constexpr double kMiddle = 128;
inline constexpr Wave kWaves[] = {{40, 0.21, 0.05, 0}, {30, -0.07, 0.17, 0}, {25, 0.11, 0.31, 1}, {20, 0.33, -0.12, 2}};

// 0 to 255; waves of 15 to 60 pixels.
inline double brightness(double x, double y) {
  double sum = kMiddle;
  for (const Wave& wave : kWaves) sum += wave.amplitude * std::sin(wave.x * x + wave.y * y + wave.phase);
  return sum;
}

// Sine and cosine of each wave along a line of points: [points][waves][2].
inline std::vector<double> sines(double first, double step, int count, double Wave::*rate, bool has_phase) {
  std::vector<double> found;
  for (int i = 0; i < count; ++i) {
    for (const Wave& wave : kWaves) {
      const double angle = wave.*rate * (first + step * i) + (has_phase ? wave.phase : 0);
      found.push_back(std::sin(angle));
      found.push_back(std::cos(angle));
    }
  }
  return found;
}

// Points of a grid, brightness as bytes, row by row: by the sines of its rows and columns, since one of each wave and
// point takes longer than what tests do with a frame.
inline std::vector<uint8_t> grid(double left, double x_step, int columns, double top, double y_step, int rows) {
  const std::vector<double> across = sines(left, x_step, columns, &Wave::x, true),
                            down = sines(top, y_step, rows, &Wave::y, false);
  constexpr size_t kOfPoint = 2 * std::size(kWaves);
  std::vector<uint8_t> found(size_t(columns) * size_t(rows));
  uint8_t* to = found.data();
  for (int row = 0; row < rows; ++row) {
    const double* const of_row = down.data() + size_t(row) * kOfPoint;
    const double* of_column = across.data();
    for (int column = 0; column < columns; ++column, of_column += kOfPoint) {
      double sum = kMiddle;
      for (size_t i = 0; i < kOfPoint; i += 2) {
        sum += kWaves[i / 2].amplitude * (of_column[i] * of_row[i + 1] + of_column[i + 1] * of_row[i]);
      }
      *to++ = uint8_t(std::lround(sum));
    }
  }
  return found;
}

// The texture moved by (x, y), in grey or in colours that lie apart.
inline maq::Frame frame(maq_pixel_format format, int width, int height, double x, double y, int64_t timestamp_ns = 0) {
  maq::Frame made;
  uint8_t* const pixels = made.allocate(format, width, height);
  // Values of a grid of `columns` to every `step`-th byte of a plane's rows.
  const auto put = [&](const std::vector<uint8_t>& values, int columns, int plane, size_t first, size_t step) {
    const maq::PlaneView& to = made.image.planes[plane];
    uint8_t* row = pixels + (to.data - pixels);
    for (size_t i = 0; i < values.size(); row += to.stride_bytes) {
      for (int column = 0; column < columns; ++column, ++i) row[first + size_t(column) * step] = values[i];
    }
  };
  const bool is_planar = format == MAQ_PIXEL_NV12, is_packed = format == MAQ_PIXEL_YUYV;
  if (format == MAQ_PIXEL_GREY8 || is_planar || is_packed) {
    put(grid(-x, 1, width, -y, 1, height), width, 0, 0, is_packed ? 2 : 1);
  } else {
    const size_t channels = format == MAQ_PIXEL_RGBA8 ? 4 : 3;
    for (size_t i = 0; i < channels; ++i) {
      put(grid(9 * double(i) - x, 1, width, -y, 1, height), width, 0, i, channels);
    }
  }
  if (is_planar || is_packed) {
    const int columns = (width + 1) / 2, rows = is_planar ? (height + 1) / 2 : height;
    for (size_t i = 0; i < 2; ++i) {
      const double left = 0.5 + 15 * double(i) - x, top = (is_planar ? 0.5 : 0) - y;
      const std::vector<uint8_t> chroma = grid(left, 2, columns, top, is_planar ? 2 : 1, rows);
      put(chroma, columns, is_planar ? 1 : 0, is_planar ? i : 1 + 2 * i, is_planar ? 2 : 4);
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
