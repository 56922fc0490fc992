// The loops of the plane sweep over a row of pixels. Numbers have 32 bits all along: code for vectors of bytes beside
// floats would be four times as long.
#pragma once

#include <cstdint>
#include <cstring>
#include <vector>

namespace maq {

inline constexpr int kWindowHalf = 3, kWindowSide = 2 * kWindowHalf + 1, kWindowArea = kWindowSide * kWindowSide;
// Variance below which nothing is to be seen, 2 grey levels squared, times kWindowArea squared.
inline constexpr float kMinSpread = 4.0f * kWindowArea * kWindowArea;
inline constexpr int32_t kOutside = 1 << 16;  // added to samples of pixels that the neighbour does not show

// 1 / sqrt(x) to 5e-6 of it, without a call, so that a loop of it becomes vectors.
inline float inverse_root(float x) {
  int32_t bits;
  std::memcpy(&bits, &x, sizeof bits);
  bits = 0x5f375a86 - (bits >> 1);
  float y;
  std::memcpy(&y, &bits, sizeof y);
  for (int step = 0; step < 2; ++step) y *= 1.5f - 0.5f * x * y * y;
  return y;
}

// A row of pixels (x, y) on a plane, in a neighbour: (at + x step), homogeneous.
struct PixelRow {
  float at[3], step[3];
};

// Bilinear samples of a photo whose `quads` have four pixels each: of its own place, right of it, below, and right
// below.
void sample_row(const uint32_t* quads, int quads_width, int quads_height, const PixelRow& row, int count,
                int32_t* samples);

// Sums over the window's rows, of a neighbour's samples, their squares, and their products with the photo.
struct ColumnSums {
  std::vector<int32_t> sample, square, product;
  void clear(size_t count) {
    for (auto* sums : {&sample, &square, &product}) sums->assign(count, 0);
  }
};

// Adds a row of samples, times the photo's grey levels, and takes one away.
void slide_columns(const int32_t* entering, const int32_t* entering_grey, const int32_t* leaving,
                   const int32_t* leaving_grey, ColumnSums& sums);

// `grey_sum`, `grey_scale`: of the photo's windows, the sum and the inverse root of the spread. Sums begin kWindowHalf
// pixels to the left. Costs are 0 to `worst`, which pixels outside of the neighbour have.
void cost_row(const ColumnSums& sums, const int32_t* grey_sum, const float* grey_scale, const int32_t* samples,
              int worst, int count, int32_t* costs);

// The mean of the two least of four costs.
void best_half(const uint8_t* a, const uint8_t* b, const uint8_t* c, const uint8_t* d, int count, uint8_t* best);

}  // namespace maq
