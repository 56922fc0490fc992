#include "image/geometry/undistort.h"

#include <algorithm>

#include "core/error.h"
#include "core/simd_clones.h"

namespace maq {
namespace {

constexpr int kFractionBits = 5;
constexpr int kPixel = 1 << kFractionBits;

// To the nearest, halves to even. Adding 1.5 * 2^23 leaves no bits for a fraction.
inline int in_fractions(double at_px) {
  constexpr float kNoFraction = 12582912;
  return int(float(at_px) * kPixel + kNoFraction) - int(kNoFraction);
}

// The three bytes of a pixel, far enough apart for their sums of products with 1024.
inline uint64_t spread(const uint8_t* pixel) {
  return uint64_t(pixel[0]) | uint64_t(pixel[1]) << 20 | uint64_t(pixel[2]) << 40;
}

// Computes all three at once: what one borrows from the next cancels in the sum, which has no negative part.
inline uint64_t blend(uint64_t first, uint64_t second, unsigned weight) {
  return first * kPixel + (second - first) * weight;
}

// The positions in another image for the pixels of a row.
struct Positions {
  explicit Positions(int width)
      : column_px(size_t(width)), row_px(size_t(width)), column(size_t(width)), row(size_t(width)) {}

  std::vector<double> column_px, row_px;  // NaN: nowhere
  std::vector<int> column, row;           // the same in fractions of a pixel, where they are in the image
};

// `valid` becomes 255 for positions inside of the image, 0 for others.
MAQ_SIMD_CLONES void to_fractions(Positions& positions, int width, int height, uint8_t* valid) {
  const double right = width - 0.5, bottom = height - 0.5;
  const size_t count = positions.column.size();
  const double* const column_px = positions.column_px.data();
  const double* const row_px = positions.row_px.data();
  int* const column = positions.column.data();
  int* const row = positions.row.data();
  for (size_t i = 0; i < count; ++i) {
    const bool is_inside =
        (column_px[i] >= -0.5) & (column_px[i] <= right) & (row_px[i] >= -0.5) & (row_px[i] <= bottom);
    column[i] = in_fractions(is_inside ? column_px[i] : 0);
    row[i] = in_fractions(is_inside ? row_px[i] : 0);
    valid[i] = is_inside ? 255 : 0;
  }
}

// A row of pixels of the BGR image, bilinear, to the bit as OpenCV's remap reads it: at the nearest 1/32 of a pixel.
// Beyond the border the last pixels are repeated. Invalid positions are black.
void read_row(const ImageView& bgr, const Positions& positions, const uint8_t* valid, uint8_t* to) {
  const uint8_t* const pixels = bgr.planes[0].data;
  const size_t stride = bgr.planes[0].stride_bytes;
  const int last_column = bgr.width_px - 1, last_row = bgr.height_px - 1;
  const size_t count = positions.column.size();
  for (size_t i = 0; i < count; ++i, to += 3) {
    if (valid[i] == 0) {
      to[0] = to[1] = to[2] = 0;
      continue;
    }
    const int x = positions.column[i] >> kFractionBits, y = positions.row[i] >> kFractionBits;
    const unsigned right = unsigned(positions.column[i] & (kPixel - 1)),
                   below = unsigned(positions.row[i] & (kPixel - 1));
    const uint8_t* const upper = pixels + size_t(std::max(y, 0)) * stride + 3 * size_t(std::max(x, 0));
    const size_t next = x >= 0 && x < last_column ? 3 : 0;
    const uint8_t* const lower = y >= 0 && y < last_row ? upper + stride : upper;
    const uint64_t over = blend(spread(upper), spread(upper + next), right);
    const uint64_t under = blend(spread(lower), spread(lower + next), right);
    constexpr uint64_t kHalf = kPixel * kPixel / 2;
    const uint64_t sums = blend(over, under, below) + (kHalf | kHalf << 20 | kHalf << 40);
    to[0] = uint8_t(sums >> (2 * kFractionBits));
    to[1] = uint8_t(sums >> (2 * kFractionBits + 20));
    to[2] = uint8_t(sums >> (2 * kFractionBits + 40));
  }
}

}  // namespace

// lens.cpp has the formula from the undistorted image to the distorted one. OpenCV's formula is not defined for
// directions where it folds back into the image.
void undistort(const ImageView& distorted, const Lens& lens, const Lens& undistorted, Frame& frame,
               std::vector<uint8_t>& valid) {
  if (distorted.format != MAQ_PIXEL_BGR8 || distorted.width_px != lens.width_px ||
      distorted.height_px != lens.height_px) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "The image is ", distorted.width_px, " x ", distorted.height_px,
                " pixels in ", pixel_format_name(distorted.format), ", but its lens is for ", lens.width_px, " x ",
                lens.height_px, " in BGR.");
  }
  check_image_size(undistorted.width_px, undistorted.height_px, "The undistorted image");
  const int width = undistorted.width_px, height = undistorted.height_px;
  uint8_t* pixels = frame.allocate_bgr(width, height);
  valid.resize(size_t(width) * size_t(height));
  uint8_t* row_valid = valid.data();

  const LensProjection projection(lens);
  std::vector<double> x(size_t(width), 0.0);
  for (int column = 0; column < width; ++column) {
    x[size_t(column)] = (column - undistorted.cx_px) / undistorted.fx_px;
  }
  Positions positions(width);
  for (int row = 0; row < height; ++row, pixels += 3 * size_t(width), row_valid += width) {
    const double y = (row - undistorted.cy_px) / undistorted.fy_px;
    projection.find_row(x, y, positions.column_px.data(), positions.row_px.data());
    to_fractions(positions, lens.width_px, lens.height_px, row_valid);
    read_row(distorted, positions, row_valid, pixels);
  }
}

}  // namespace maq
