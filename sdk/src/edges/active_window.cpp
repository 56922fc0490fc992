#include "edges/active_window.h"

#include <algorithm>
#include <cmath>

#include "core/rounding.h"
#include "core/simd_clones.h"

namespace maq {
namespace {

constexpr int kTile_px = 16;  // areas are 2 x 2 tiles and overlap by one
constexpr double kMinKnown = 0.9;
// A crease of 18 degrees departs from its best plane by 0.25 r or more (root mean square) in one of the areas that it
// crosses; by chance, white noise departs by at most about a fifth from the estimate by its second differences.
constexpr double kFloor_r = 0.1, kNoiseFactor = 1.2;
// From the mean absolute second difference to the standard deviation, of white Gaussian noise.
constexpr double kDeviationOfBends = 0.51166;  // sqrt(pi / 2) / sqrt(6)
constexpr int kWindowMargin_px = 16 + 16;      // eps_r, of surfaces that face the camera; and context

// Sums over rows of a tile, in columns: their order is the same however wide vectors are.
struct Columns {
  double n[kTile_px], y[kTile_px], yy[kTile_px], q[kTile_px], qy[kTile_px], qq[kTile_px], bends[kTile_px],
      bend_count[kTile_px];
};

// The depths of a tile's row with one more on either side.
MAQ_SIMD_CLONES void add_row(const float* __restrict depth, double y, Columns& __restrict sums) {
  float inverse[kTile_px + 2], known[kTile_px + 2];
  for (int x = 0; x < kTile_px + 2; ++x) {
    known[x] = depth[x] > 0 ? 1.0f : 0.0f;
    inverse[x] = known[x] / (depth[x] + (1 - known[x]));
  }
  for (int x = 0; x < kTile_px; ++x) {
    const double n = double(known[x + 1]), q = double(inverse[x + 1]);
    sums.n[x] += n;
    sums.y[x] += n * y;
    sums.yy[x] += n * y * y;
    sums.q[x] += q;
    sums.qy[x] += q * y;
    sums.qq[x] += q * q;
    const float all_known = known[x] * known[x + 1] * known[x + 2];
    sums.bends[x] += double(all_known * std::abs(inverse[x] - inverse[x + 1] + (inverse[x + 2] - inverse[x + 1])));
    sums.bend_count[x] += double(all_known);
  }
}

// A half of `whole`, or all of it, that holds [begin, end) and its surroundings; it may end behind `whole`.
std::pair<int, int> part_of(int begin, int end, int whole, int multiple) {
  begin = std::max(0, begin - kWindowMargin_px) / multiple * multiple;
  const int half = round_up(divide_up(whole, 2), multiple), padded = round_up(whole, multiple);
  if (std::min(end + kWindowMargin_px, whole) - begin > half) return {0, padded};
  return {std::min(begin, padded - half), half};
}

}  // namespace

void ActiveWindow::sum_row_of_tiles(const DepthPlane& depth, int row) {
  const int rows = std::min(kTile_px, depth.height_px - row * kTile_px);
  for (int column = 0; column < columns_; ++column) {
    Columns sums{};
    // Limits of the frame; depth beyond it is unknown.
    const int left = column * kTile_px - 1, begin = std::max(0, left),
              end = std::min(left + kTile_px + 2, depth.width_px);
    float line[kTile_px + 2] = {};
    for (int y = 0; y < rows; ++y) {
      const float* const from = depth.metres + size_t(row * kTile_px + y) * size_t(depth.width_px);
      std::copy(from + begin, from + end, line + begin - left);
      add_row(line, double(y), sums);
    }
    Moments tile;
    for (int x = 0; x < kTile_px; ++x) {
      tile.n += sums.n[x];
      tile.x += x * sums.n[x];
      tile.y += sums.y[x];
      tile.xx += x * x * sums.n[x];
      tile.xy += x * sums.y[x];
      tile.yy += sums.yy[x];
      tile.q += sums.q[x];
      tile.qx += x * sums.q[x];
      tile.qy += sums.qy[x];
      tile.qq += sums.qq[x];
      tile.bends += sums.bends[x];
      tile.bend_count += sums.bend_count[x];
    }
    tiles_[size_t(row * columns_ + column)] = tile;
  }
}

bool ActiveWindow::has_edge(int column, int row, double focal_px, int64_t pixels) const {
  Moments area;
  for (int i = row; i < std::min(row + 2, rows_); ++i) {
    for (int j = column; j < std::min(column + 2, columns_); ++j) {
      const Moments& tile = tiles_[size_t(i * columns_ + j)];
      const double dx = (j - column) * kTile_px, dy = (i - row) * kTile_px;
      area.n += tile.n;
      area.x += tile.x + dx * tile.n;
      area.y += tile.y + dy * tile.n;
      area.xx += tile.xx + dx * (2 * tile.x + dx * tile.n);
      area.xy += tile.xy + dx * tile.y + dy * tile.x + dx * dy * tile.n;
      area.yy += tile.yy + dy * (2 * tile.y + dy * tile.n);
      area.q += tile.q;
      area.qx += tile.qx + dx * tile.q;
      area.qy += tile.qy + dy * tile.q;
      area.qq += tile.qq;
      area.bends += tile.bends;
      area.bend_count += tile.bend_count;
    }
  }
  if (area.n == 0) return false;
  if (area.n < kMinKnown * double(pixels) || area.bend_count == 0) return true;
  const double n = area.n, mean = area.q / n;
  const double xx = area.xx - area.x * area.x / n, xy = area.xy - area.x * area.y / n,
               yy = area.yy - area.y * area.y / n;
  const double qx = area.qx - area.x * mean, qy = area.qy - area.y * mean, qq = area.qq - area.q * mean;
  const double determinant = xx * yy - xy * xy;
  if (!(determinant > 0)) return true;  // one row or column of pixels
  const double explained = (qx * (qx * yy - qy * xy) + qy * (qy * xx - qx * xy)) / determinant;
  const double in_r = focal_px / mean;  // of an error of inverse depth
  const double residual_r = std::sqrt(std::max(0.0, qq - explained) / n) * in_r;
  const double noise_r = kDeviationOfBends * area.bends / area.bend_count * in_r;
  return !(residual_r <= kFloor_r + kNoiseFactor * noise_r);
}

FieldWindow ActiveWindow::find(const DepthPlane& depth, const Intrinsics& intrinsics, int multiple_px,
                               WorkerThreads& threads) {
  columns_ = divide_up(depth.width_px, kTile_px);
  rows_ = divide_up(depth.height_px, kTile_px);
  tiles_.resize(size_t(columns_) * size_t(rows_));
  threads.run(size_t(rows_), [&](size_t row, int) { sum_row_of_tiles(depth, int(row)); });

  const double focal_px = std::sqrt(intrinsics.fx_px * intrinsics.fy_px);
  int left = depth.width_px, right = 0, top = depth.height_px, bottom = 0;
  for (int row = 0; row < std::max(1, rows_ - 1); ++row) {
    for (int column = 0; column < std::max(1, columns_ - 1); ++column) {
      const int x = column * kTile_px, y = row * kTile_px;
      const int end_x = std::min(x + 2 * kTile_px, depth.width_px), end_y = std::min(y + 2 * kTile_px, depth.height_px);
      if (!has_edge(column, row, focal_px, int64_t(end_x - x) * (end_y - y))) continue;
      left = std::min(left, x);
      right = std::max(right, end_x);
      top = std::min(top, y);
      bottom = std::max(bottom, end_y);
    }
  }
  if (right == 0) return {};
  const auto [x, width] = part_of(left, right, depth.width_px, multiple_px);
  const auto [y, height] = part_of(top, bottom, depth.height_px, multiple_px);
  return {x, y, width, height};
}

}  // namespace maq
