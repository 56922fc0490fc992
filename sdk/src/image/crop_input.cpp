#include "image/crop_input.h"

#include <algorithm>
#include <cmath>

#include "core/simd_clones.h"

namespace maq {
namespace {

constexpr double kMinScaleOfBilinear = 0.8;  // below it pixels are averaged first
constexpr int kMarginPx = 2;                 // around the crop's part, for bilinear interpolation

// The pixels [x0, x1) x [y0, y1) of the image that the crop reads; empty where it lies beyond the image.
struct Window {
  int x0, y0, x1, y1;
};

Window seen_window(const ImageView& image, const AffineMap& to_image, const NetworkSize& crop_size) {
  const double width = crop_size.width_px, height = crop_size.height_px;
  Point low = to_image({0, 0}), high = low;
  for (const Point& corner : {to_image({width, 0}), to_image({0, height}), to_image({width, height})}) {
    low = {std::min(low.x, corner.x), std::min(low.y, corner.y)};
    high = {std::max(high.x, corner.x), std::max(high.y, corner.y)};
  }
  const auto clipped = [](double at, int size) { return int(std::clamp(at, 0.0, double(size))); };
  // Even: where two pixels share their colour.
  return {clipped(std::floor(low.x) - kMarginPx, image.width_px) / 2 * 2,
          clipped(std::floor(low.y) - kMarginPx, image.height_px) / 2 * 2,
          clipped(std::ceil(high.x) + kMarginPx, image.width_px),
          clipped(std::ceil(high.y) + kMarginPx, image.height_px)};
}

// One line of the crop, from three planes of width x height. `at`: the first pixel's centre, in indices of the planes;
// `step`: from one pixel to the next. Beyond the planes is zero.
MAQ_SIMD_CLONES void read_line(const float* planes, int width, int height, const Point& at, const Point& step,
                               int count, float* line, size_t line_plane) {
  const size_t plane = size_t(width) * size_t(height);
  for (int i = 0; i < count; ++i) {
    // Clamped: positions far outside have no weight and fit an int.
    const float x = float(std::clamp(at.x + i * step.x, -1.0, double(width)));
    const float y = float(std::clamp(at.y + i * step.y, -1.0, double(height)));
    const int left = int(x + 1.0f) - 1, top = int(y + 1.0f) - 1;
    const float fraction_x = x - float(left), fraction_y = y - float(top);
    const float weight_left = left >= 0 && left < width ? 1 - fraction_x : 0;
    const float weight_right = left + 1 < width ? fraction_x : 0;
    const float weight_top = top >= 0 && top < height ? 1 - fraction_y : 0;
    const float weight_bottom = top + 1 < height ? fraction_y : 0;
    const auto clamped = [](int index, int size) { return size_t(index < 0 ? 0 : index < size ? index : size - 1); };
    const size_t upper = clamped(top, height) * size_t(width), lower = clamped(top + 1, height) * size_t(width);
    const size_t first = clamped(left, width), second = clamped(left + 1, width);
    for (size_t c = 0; c < 3; ++c) {
      const float* values = planes + c * plane;
      line[c * line_plane + size_t(i)] =
          weight_top * (weight_left * values[upper + first] + weight_right * values[upper + second]) +
          weight_bottom * (weight_left * values[lower + first] + weight_right * values[lower + second]);
    }
  }
}

}  // namespace

AffineMap AffineMap::then(const AffineMap& second) const {
  const Point shift = second({shift_x, shift_y});
  return {second.xx * xx + second.xy * yx, second.xx * xy + second.xy * yy, shift.x,
          second.yx * xx + second.yy * yx, second.yx * xy + second.yy * yy, shift.y};
}

AffineMap AffineMap::inverse() const {
  const double determinant = xx * yy - xy * yx;
  AffineMap back;
  back.xx = yy / determinant;
  back.xy = -xy / determinant;
  back.yx = -yx / determinant;
  back.yy = xx / determinant;
  back.shift_x = -(back.xx * shift_x + back.xy * shift_y);
  back.shift_y = -(back.yx * shift_x + back.yy * shift_y);
  return back;
}

void make_crop_input(const ImageView& image, const AffineMap& to_image, const NetworkSize& crop_size,
                     const NetworkInputSpec& spec, CropInput& crop) {
  const size_t plane = size_t(crop_size.width_px) * size_t(crop_size.height_px);
  crop.values.assign(3 * plane, 0);
  const Window seen = seen_window(image, to_image, crop_size);
  const int width = seen.x1 - seen.x0, height = seen.y1 - seen.y0;
  if (width <= 0 || height <= 0) return;

  const double scale = 1 / std::hypot(to_image.xx, to_image.yx);
  NetworkSize size{width, height};
  if (scale < kMinScaleOfBilinear) {
    size = {std::max(1, int(std::lround(width * scale))), std::max(1, int(std::lround(height * scale)))};
  }
  NetworkInputSpec unpadded = spec;
  unpadded.multiple_of = 1;
  make_network_input(window_of(image, seen.x0, seen.y0, width, height), size, unpadded, crop.window);

  const double scale_x = double(size.width_px) / width, scale_y = double(size.height_px) / height;
  const Point step{to_image.xx * scale_x, to_image.yx * scale_y};
  for (int row = 0; row < crop_size.height_px; ++row) {
    const Point first = to_image({0.5, row + 0.5});
    const Point at{(first.x - seen.x0) * scale_x - 0.5, (first.y - seen.y0) * scale_y - 0.5};
    read_line(crop.window.values.data(), size.width_px, size.height_px, at, step, crop_size.width_px,
              crop.values.data() + size_t(row) * size_t(crop_size.width_px), plane);
  }
}

}  // namespace maq
