#include "scene/stereo/matching_cost.h"

#include <algorithm>
#include <cstring>

#include "scene/stereo/cost_rows.h"

namespace maq {
namespace {

constexpr int kCostBandRows = 32;

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

PixelRow row_on_plane(const PixelTransfer& transfer, double inverse_depth, int y) {
  PixelRow row;
  for (int i = 0; i < 3; ++i) {
    row.at[i] = float(transfer.turn[3 * i + 1] * y + transfer.turn[3 * i + 2] + transfer.shift[i] * inverse_depth);
    row.step[i] = float(transfer.turn[3 * i]);
  }
  return row;
}

int inside(int at, int size) { return std::min(std::max(at, 0), size - 1); }

// A row with the window's half on both sides, the last pixels repeated.
void pad_row(int32_t* row, int width) {
  std::fill_n(row, kWindowHalf, row[kWindowHalf]);
  std::fill_n(row + kWindowHalf + width, kWindowHalf, row[kWindowHalf + width - 1]);
}

// The photo with kWindowHalf pixels repeated around it.
struct PaddedGrey {
  PaddedGrey(const StereoPhoto& photo)
      : width_px(photo.camera.width_px), height_px(photo.camera.height_px), stride(size_t(width_px) + 2 * kWindowHalf) {
    pixels.resize(stride * size_t(height_px));
    for (int y = 0; y < height_px; ++y) {
      int32_t* const to = &pixels[size_t(y) * stride];
      std::copy_n(&photo.grey[size_t(y) * size_t(width_px)], width_px, to + kWindowHalf);
      pad_row(to, width_px);
    }
  }
  const int32_t* row(int y) const { return &pixels[size_t(inside(y, height_px)) * stride]; }

  int width_px, height_px;
  size_t stride;
  std::vector<int32_t> pixels;
};

// Costs of one neighbour at one plane, for a band of rows.
class BandCost {
 public:
  BandCost(const PaddedGrey& grey, const int32_t* sum, const float* scale)
      : grey_(grey), sum_(sum), scale_(scale), nothing_(grey.stride, 0), costs_(grey.stride) {
    for (auto& row : samples_) row.resize(grey.stride);
  }

  void compute(const std::vector<uint32_t>& quads, const PinholeCamera& other, const PixelTransfer& transfer,
               double inverse_depth, int top, int bottom, uint8_t* costs) {
    const int width = grey_.width_px;
    sums_.clear(grey_.stride);
    for (int y = top - kWindowHalf; y < bottom + kWindowHalf; ++y) {
      int32_t* const samples = slot(y);
      sample_row(quads.data(), other.width_px, other.height_px,
                 row_on_plane(transfer, inverse_depth, inside(y, grey_.height_px)), width, samples + kWindowHalf);
      pad_row(samples, width);
      const bool is_full = y >= top - kWindowHalf + kWindowSide;
      slide_columns(samples, grey_.row(y), is_full ? slot(y - kWindowSide) : nothing_.data(),
                    is_full ? grey_.row(y - kWindowSide) : nothing_.data(), sums_);
      const int middle = y - kWindowHalf;
      if (middle < top) continue;
      const size_t at = size_t(middle) * size_t(width);
      cost_row(sums_, sum_ + at, scale_ + at, slot(middle) + kWindowHalf, MatchingCost::kWorst, width, costs_.data());
      std::copy_n(costs_.begin(), width, costs + size_t(middle - top) * size_t(width));
    }
  }

 private:
  // One row more than the window has, so that the one that leaves it is still there when the next has been sampled.
  static constexpr int kSlots = kWindowSide + 1;
  int32_t* slot(int y) { return samples_[size_t(y + kSlots) % kSlots].data(); }

  const PaddedGrey& grey_;
  const int32_t* sum_;
  const float* scale_;
  std::vector<int32_t> nothing_, costs_, samples_[kSlots];
  ColumnSums sums_;
};

// Sums and inverse roots of the spread of all windows of the photo.
void measure_windows(const PaddedGrey& grey, std::vector<int32_t>& sums, std::vector<float>& scales) {
  const size_t width = size_t(grey.width_px);
  sums.resize(width * size_t(grey.height_px));
  scales.resize(sums.size());
  for (int y = 0; y < grey.height_px; ++y) {
    std::vector<int32_t> sample(grey.stride), square(grey.stride);
    for (int k = -kWindowHalf; k <= kWindowHalf; ++k) {
      const int32_t* const row = grey.row(y + k);
      for (size_t i = 0; i < grey.stride; ++i) {
        sample[i] += row[i];
        square[i] += row[i] * row[i];
      }
    }
    for (size_t x = 0; x < width; ++x) {
      int32_t sum = 0, squares = 0;
      for (size_t k = 0; k < kWindowSide; ++k) {
        sum += sample[x + k];
        squares += square[x + k];
      }
      sums[size_t(y) * width + x] = sum;
      scales[size_t(y) * width + x] = inverse_root(float(kWindowArea * squares - sum * sum) + kMinSpread);
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
  const size_t bands = size_t(height_px_ + kCostBandRows - 1) / kCostBandRows;
  threads.run(bands, [&](size_t band, int) {
    const int top = int(band) * kCostBandRows, bottom = std::min(top + kCostBandRows, height_px_);
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
      // With two neighbours the better one counts: each is given twice.
      best_half(of_neighbour[0].data(), of_neighbour[count > 2 ? 1 : 0].data(), of_neighbour[count > 2 ? 2 : 1].data(),
                of_neighbour[count > 2 ? 3 : 1].data(), int(pixels), best);
    }
    for (size_t i = 0; i < pixels; ++i) {
      uint8_t* const to = &costs_[(size_t(top) * width + i) * DepthPlanes::kCount];
      for (size_t plane = 0; plane < DepthPlanes::kCount; ++plane) to[plane] = planes_of_band[plane * pixels + i];
    }
  });
}

}  // namespace maq
