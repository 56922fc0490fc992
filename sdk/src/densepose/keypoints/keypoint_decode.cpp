#include "densepose/keypoints/keypoint_decode.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace maq {
namespace {

constexpr int kReach = 2;  // cells around the likeliest one
// Cells this far below the largest logit are left out of the sum: together less than 0.05 % of it.
constexpr float kNegligible = 16;

struct Peak {
  float logit = -std::numeric_limits<float>::infinity();
  int row = -1, column = -1;
};

class CellLogits {
 public:
  CellLogits(const float* logits, int size) : logits_(logits), size_(size) {}

  int size() const { return size_; }
  const float* at(int row, int column) const {
    const size_t four = size_t(row / 2) * size_t(size_ / 2) + size_t(column / 2);
    return logits_ + (4 * four + size_t(row % 2 * 2 + column % 2)) * kKeypoints;
  }

 private:
  const float* logits_;
  int size_;
};

std::array<Peak, kKeypoints> find_peaks(const CellLogits& cells) {
  std::array<Peak, kKeypoints> peaks;
  for (int row = 0; row < cells.size(); ++row) {
    for (int column = 0; column < cells.size(); ++column) {
      const float* const logits = cells.at(row, column);
      for (size_t k = 0; k < kKeypoints; ++k) {
        if (logits[k] > peaks[k].logit) peaks[k] = {logits[k], row, column};
      }
    }
  }
  return peaks;
}

// Sums of exp(logit - largest) over all cells.
std::array<float, kKeypoints> sum_odds(const CellLogits& cells, const std::array<Peak, kKeypoints>& peaks) {
  std::array<float, kKeypoints> sums{};
  for (int row = 0; row < cells.size(); ++row) {
    for (int column = 0; column < cells.size(); ++column) {
      const float* const logits = cells.at(row, column);
      for (size_t k = 0; k < kKeypoints; ++k) {
        const float below = logits[k] - peaks[k].logit;
        if (below > -kNegligible) sums[k] += std::exp(below);
      }
    }
  }
  return sums;
}

}  // namespace

Keypoints decode_keypoints(const float* logits, int size, const AffineMap& to_image) {
  const CellLogits cells(logits, size);
  const std::array<Peak, kKeypoints> peaks = find_peaks(cells);
  const std::array<float, kKeypoints> sums = sum_odds(cells, peaks);
  Keypoints found;
  for (size_t k = 0; k < kKeypoints; ++k) {
    const Peak& peak = peaks[k];
    double x = double(size) / 2, y = x, mass = 0;
    // NaN is never a peak. The peak itself is part of the sum, which therefore is 1 or more.
    if (peak.row >= 0 && std::isfinite(peak.logit)) {
      double sum_x = 0, sum_y = 0;
      for (int row = std::max(peak.row - kReach, 0); row <= std::min(peak.row + kReach, size - 1); ++row) {
        for (int column = std::max(peak.column - kReach, 0); column <= std::min(peak.column + kReach, size - 1);
             ++column) {
          const float logit = cells.at(row, column)[k];
          if (!(logit > -std::numeric_limits<float>::infinity())) continue;
          const double odds = double(std::exp(logit - peak.logit));
          sum_x += odds * (column + 0.5);
          sum_y += odds * (row + 0.5);
          mass += odds;
        }
      }
      x = sum_x / mass;
      y = sum_y / mass;
      mass = std::min(mass / double(sums[k]), 1.0);
    }
    const Point at = to_image({x, y});
    found[k] = {float(at.x), float(at.y), float(mass)};
  }
  return found;
}

}  // namespace maq
