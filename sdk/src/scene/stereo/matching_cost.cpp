#include "scene/stereo/matching_cost.h"

#include <algorithm>
#include <cstring>

#include "core/simd_clones.h"

namespace maq {
namespace {

constexpr int kHalf = 3, kWindow = 2 * kHalf + 1, kArea = kWindow * kWindow;
constexpr int kBandRows = 32;
// Variance below which nothing is to be seen, 2 grey levels squared, times kArea squared.
constexpr float kMinSpread = 4.0f * kArea * kArea;

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

// The four pixels from each one to the right and down, as one number: a sample is one load.
void pack_quads(const StereoPhoto& photo, std::vector<uint32_t>& quads) {
  const int width = photo.camera.width_px, height = photo.camera.height_px;
  quads.resize(photo.pixels());
  for (int y = 0; y < height; ++y) {
    const uint8_t* const row = &photo.grey[size_t(y) * size_t(width)];
    const uint8_t* const below = y + 1 < height ? row + width : row;
    for (int x = 0; x < width; ++x) {
      const int right = std::min(x + 1, width - 1);
      quads[size_t(y) * size_t(width) + size_t(x)] =
          uint32_t(row[x]) | uint32_t(row[right]) << 8 | uint32_t(below[x]) << 16 | uint32_t(below[right]) << 24;
    }
  }
}

// A row of pixels (x, y) on a plane, in a neighbour: (at + x step), homogeneous.
struct PixelRow {
  float at[3], step[3];
};

PixelRow row_on_plane(const PixelTransfer& transfer, double inverse_depth, int y) {
  PixelRow row;
  for (int i = 0; i < 3; ++i) {
    row.at[i] = float(transfer.turn[3 * i + 1] * y + transfer.turn[3 * i + 2] + transfer.shift[i] * inverse_depth);
    row.step[i] = float(transfer.turn[3 * i]);
  }
  return row;
}

// `values`: bilinear; `outside`: 255 where the neighbour does not show the pixel, 0 elsewhere.
MAQ_SIMD_CLONES void sample_row(const uint32_t* __restrict quads, int quads_width, int quads_height,
                                const PixelRow& row, int count, uint8_t* __restrict values,
                                uint8_t* __restrict outside) {
  const float last_x = float(quads_width - 1), last_y = float(quads_height - 1);
  for (int i = 0; i < count; ++i) {
    const float x = float(i);
    const float z = row.at[2] + row.step[2] * x;
    const float inverse = 1.0f / z;
    const float u = (row.at[0] + row.step[0] * x) * inverse, v = (row.at[1] + row.step[1] * x) * inverse;
    const float over_u = u > 0.0f ? u : 0.0f, over_v = v > 0.0f ? v : 0.0f;
    const float in_u = over_u < last_x ? over_u : last_x, in_v = over_v < last_y ? over_v : last_y;
    const int column = int(in_u), line = int(in_v);
    const int right = int((in_u - float(column)) * 64.0f + 0.5f), down = int((in_v - float(line)) * 64.0f + 0.5f);
    const uint32_t quad = quads[line * quads_width + column];
    const int above = int(quad & 255u) * (64 - right) + int(quad >> 8 & 255u) * right;
    const int below = int(quad >> 16 & 255u) * (64 - right) + int(quad >> 24) * right;
    values[i] = uint8_t((above * (64 - down) + below * down + 2048) >> 12);
    const int is_inside = int(in_u == u) & int(in_v == v) & int(z > 0.0f);
    outside[i] = uint8_t(is_inside - 1);
  }
}

// Sums over the window's rows, of a neighbour's samples, their squares, and their products with the photo.
struct ColumnSums {
  std::vector<int32_t> sample, square, product;
  void clear(size_t count) {
    for (auto* sums : {&sample, &square, &product}) sums->assign(count, 0);
  }
};

MAQ_SIMD_CLONES void slide_columns(const uint8_t* __restrict entering, const uint8_t* __restrict entering_grey,
                                   const uint8_t* __restrict leaving, const uint8_t* __restrict leaving_grey, int count,
                                   int32_t* __restrict sample, int32_t* __restrict square,
                                   int32_t* __restrict product) {
  for (int i = 0; i < count; ++i) {
    const int in = entering[i], out = leaving[i];
    sample[i] += in - out;
    square[i] += in * in - out * out;
    product[i] += in * entering_grey[i] - out * leaving_grey[i];
  }
}

// `grey_sum`, `grey_scale`: of the photo's windows, the sum and the inverse root of the spread.
MAQ_SIMD_CLONES void cost_row(const int32_t* __restrict sample, const int32_t* __restrict square,
                              const int32_t* __restrict product, const int32_t* __restrict grey_sum,
                              const float* __restrict grey_scale, const uint8_t* __restrict outside, int count,
                              uint8_t* __restrict cost) {
  for (int i = 0; i < count; ++i) {
    const auto over_window = [i](const int32_t* of) {
      return of[i] + of[i + 1] + of[i + 2] + of[i + 3] + of[i + 4] + of[i + 5] + of[i + 6];
    };
    const int sum = over_window(sample);
    const float spread = float(kArea * over_window(square) - sum * sum);
    const float together = float(kArea * over_window(product) - sum * grey_sum[i]);
    const float correlation = together * grey_scale[i] * inverse_root(spread + kMinSpread);
    const int rounded = int((1.0f - correlation) * float(MatchingCost::kWorst) + 0.5f) | outside[i];
    const int most = rounded < MatchingCost::kWorst ? rounded : MatchingCost::kWorst;
    cost[i] = uint8_t(most > 0 ? most : 0);
  }
}

// The mean of the two least of four; the least where they are of one or two neighbours.
MAQ_SIMD_CLONES void best_half(const uint8_t* __restrict a, const uint8_t* __restrict b, const uint8_t* __restrict c,
                               const uint8_t* __restrict d, int count, uint8_t* __restrict best) {
  for (int i = 0; i < count; ++i) {
    const uint8_t low = a[i] < b[i] ? a[i] : b[i], high = a[i] < b[i] ? b[i] : a[i];
    const uint8_t low2 = c[i] < d[i] ? c[i] : d[i], high2 = c[i] < d[i] ? d[i] : c[i];
    const uint8_t first = low < low2 ? low : low2, other = low < low2 ? low2 : low;
    const uint8_t highs = high < high2 ? high : high2;
    const uint8_t second = other < highs ? other : highs;
    best[i] = uint8_t((first + second + 1) >> 1);
  }
}

MAQ_SIMD_CLONES void take_lower(const uint8_t* __restrict other, int count, uint8_t* __restrict best) {
  for (int i = 0; i < count; ++i) best[i] = other[i] < best[i] ? other[i] : best[i];
}

int inside(int at, int size) { return std::min(std::max(at, 0), size - 1); }

// A row with the window's half on both sides, the last pixels repeated.
void pad_row(uint8_t* row, int width) {
  std::memset(row, row[kHalf], kHalf);
  std::memset(row + kHalf + width, row[kHalf + width - 1], kHalf);
}

// The photo with kHalf pixels repeated around it.
struct PaddedGrey {
  PaddedGrey(const StereoPhoto& photo)
      : width_px(photo.camera.width_px), height_px(photo.camera.height_px), stride(size_t(width_px) + 2 * kHalf) {
    pixels.resize(stride * size_t(height_px));
    for (int y = 0; y < height_px; ++y) {
      uint8_t* const to = &pixels[size_t(y) * stride];
      std::memcpy(to + kHalf, &photo.grey[size_t(y) * size_t(width_px)], size_t(width_px));
      pad_row(to, width_px);
    }
  }
  const uint8_t* row(int y) const { return &pixels[size_t(inside(y, height_px)) * stride]; }

  int width_px, height_px;
  size_t stride;
  std::vector<uint8_t> pixels;
};

// Costs of one neighbour at one plane, for a band of rows.
class BandCost {
 public:
  BandCost(const PaddedGrey& grey, const int32_t* sum, const float* scale)
      : grey_(grey), sum_(sum), scale_(scale), nothing_(grey.stride, 0) {
    for (auto& row : values_) row.resize(grey.stride);
    for (auto& row : outside_) row.resize(size_t(grey.width_px));
  }

  void compute(const std::vector<uint32_t>& quads, const PinholeCamera& other, const PixelTransfer& transfer,
               double inverse_depth, int top, int bottom, uint8_t* costs) {
    const int width = grey_.width_px;
    sums_.clear(grey_.stride);
    for (int y = top - kHalf; y < bottom + kHalf; ++y) {
      uint8_t* const values = slot(values_, y).data();
      sample_row(quads.data(), other.width_px, other.height_px,
                 row_on_plane(transfer, inverse_depth, inside(y, grey_.height_px)), width, values + kHalf,
                 slot(outside_, y).data());
      pad_row(values, width);
      const bool is_full = y >= top - kHalf + kWindow;
      slide_columns(values, grey_.row(y), is_full ? slot(values_, y - kWindow).data() : nothing_.data(),
                    is_full ? grey_.row(y - kWindow) : nothing_.data(), int(grey_.stride), sums_.sample.data(),
                    sums_.square.data(), sums_.product.data());
      const int middle = y - kHalf;
      if (middle < top) continue;
      const size_t at = size_t(middle) * size_t(width);
      cost_row(sums_.sample.data(), sums_.square.data(), sums_.product.data(), sum_ + at, scale_ + at,
               slot(outside_, middle).data(), width, costs + size_t(middle - top) * size_t(width));
    }
  }

 private:
  // One row more than the window has, so that the one that leaves it is still there when the next has been sampled.
  static constexpr int kSlots = kWindow + 1;
  using Rows = std::vector<uint8_t>[kSlots];
  static std::vector<uint8_t>& slot(Rows& rows, int y) { return rows[size_t(y + kSlots) % kSlots]; }

  const PaddedGrey& grey_;
  const int32_t* sum_;
  const float* scale_;
  std::vector<uint8_t> nothing_;
  Rows values_, outside_;
  ColumnSums sums_;
};

// Sums and inverse roots of the spread of all windows of the photo.
void measure_windows(const PaddedGrey& grey, std::vector<int32_t>& sums, std::vector<float>& scales) {
  const size_t width = size_t(grey.width_px);
  sums.resize(width * size_t(grey.height_px));
  scales.resize(sums.size());
  for (int y = 0; y < grey.height_px; ++y) {
    std::vector<int32_t> sample(grey.stride), square(grey.stride);
    for (int k = -kHalf; k <= kHalf; ++k) {
      const uint8_t* const row = grey.row(y + k);
      for (size_t i = 0; i < grey.stride; ++i) {
        sample[i] += row[i];
        square[i] += row[i] * row[i];
      }
    }
    for (size_t x = 0; x < width; ++x) {
      int32_t sum = 0, squares = 0;
      for (size_t k = 0; k < kWindow; ++k) {
        sum += sample[x + k];
        squares += square[x + k];
      }
      sums[size_t(y) * width + x] = sum;
      scales[size_t(y) * width + x] = inverse_root(float(kArea * squares - sum * sum) + kMinSpread);
    }
  }
}

}  // namespace

void MatchingCost::compute(const StereoPhoto& photo, const std::vector<const StereoPhoto*>& neighbours,
                           const DepthPlanes& planes, WorkerThreads& threads) {
  width_px_ = photo.camera.width_px;
  height_px_ = photo.camera.height_px;
  const size_t count = std::min(neighbours.size(), size_t(kMaxNeighbours)), width = size_t(width_px_);
  std::vector<PixelTransfer> transfers;
  for (size_t k = 0; k < count; ++k) transfers.emplace_back(photo.camera, neighbours[k]->camera);
  const PaddedGrey grey(photo);
  costs_.resize(photo.pixels() * DepthPlanes::kCount);
  threads.run(count + 1, [&](size_t task, int) {
    if (task < count) {
      pack_quads(*neighbours[task], quads_[task]);
    } else {
      measure_windows(grey, sum_, scale_);
    }
  });
  const size_t bands = size_t(height_px_ + kBandRows - 1) / kBandRows;
  threads.run(bands, [&](size_t band, int) {
    const int top = int(band) * kBandRows, bottom = std::min(top + kBandRows, height_px_);
    const size_t pixels = size_t(bottom - top) * width;
    BandCost of_band(grey, sum_.data(), scale_.data());
    std::vector<uint8_t> planes_of_band(pixels * DepthPlanes::kCount), of_neighbour[kMaxNeighbours];
    for (auto& costs : of_neighbour) costs.assign(pixels, kWorst);
    for (int plane = 0; plane < DepthPlanes::kCount; ++plane) {
      for (size_t k = 0; k < count; ++k) {
        of_band.compute(quads_[k], neighbours[k]->camera, transfers[k], planes.inverse_depth(plane), top, bottom,
                        of_neighbour[k].data());
      }
      uint8_t* const best = &planes_of_band[size_t(plane) * pixels];
      if (count > 2) {
        best_half(of_neighbour[0].data(), of_neighbour[1].data(), of_neighbour[2].data(), of_neighbour[3].data(),
                  int(pixels), best);
      } else {
        std::memcpy(best, of_neighbour[0].data(), pixels);
        take_lower(of_neighbour[1].data(), int(pixels), best);
      }
    }
    for (size_t i = 0; i < pixels; ++i) {
      uint8_t* const to = &costs_[(size_t(top) * width + i) * DepthPlanes::kCount];
      for (size_t plane = 0; plane < DepthPlanes::kCount; ++plane) to[plane] = planes_of_band[plane * pixels + i];
    }
  });
}

}  // namespace maq
