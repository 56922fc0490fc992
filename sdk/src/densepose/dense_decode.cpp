#include "densepose/dense_decode.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <optional>

#include "core/rounding.h"
#include "core/simd_clones.h"

namespace maq {
namespace {

constexpr int kMaxClasses = 64;
// Sentinel below every logit of a network: stands for a missing class. Finite, so that interpolating it gives no NaN;
// logits are clamped to [kSentinelLogit, -kSentinelLogit].
constexpr float kSentinelLogit = -1e30f;
constexpr int kLanes = 8;

using Tap = ResizeTap;

// Where each pixel of `to` lies between two cells of `from`.
void fill_taps(int from, int to, std::vector<Tap>& taps) {
  taps.resize(static_cast<size_t>(to));
  const float scale = float(from) / float(to);
  for (int i = 0; i < to; ++i) {
    const float at = std::max(0.0f, (float(i) + 0.5f) * scale - 0.5f);
    const int low = std::min(int(at), from - 1);
    taps[size_t(i)] = {low, std::min(low + 1, from - 1), at - float(low)};
  }
}

// The first of `count` values (of `padded`, a multiple of kLanes, the rest kSentinelLogit) that is the largest. NaN
// never wins; -1 if all are NaN or kSentinelLogit.
inline int best_of(const float* values, int count, int padded) {
  std::array<float, kLanes> lane_best;
  lane_best.fill(kSentinelLogit);
  for (int c = 0; c < padded; c += kLanes) {
    for (int lane = 0; lane < kLanes; ++lane) {
      const float value = values[c + lane];
      lane_best[size_t(lane)] = value > lane_best[size_t(lane)] ? value : lane_best[size_t(lane)];
    }
  }
  float best = lane_best[0];
  for (const float value : lane_best) best = value > best ? value : best;
  for (int c = 0; c < count; ++c) {
    if (values[c] == best) return c;
  }
  return -1;
}

// One row of the resized logits before its columns are resized, with the classes innermost, so that comparing the
// classes of a pixel runs over neighbouring memory. Padded with kSentinelLogit to whole lanes.
class ClassRow {
 public:
  ClassRow(int classes, int size, std::vector<float>& values)
      : classes_(classes), size_(size), padded_(round_up(classes, kLanes)), values_(values) {
    values_.assign(size_t(size) * size_t(padded_), kSentinelLogit);
  }

  // The classes from `first` on of each cell.
  void fill(const DenseLogits& logits, int first, const Tap& row) {
    for (int x = 0; x < size_; ++x) {
      const float* low = logits.cell(row.low, x) + first;
      const float* high = logits.cell(row.high, x) + first;
      float* mixed = values_.data() + size_t(x) * size_t(padded_);
      for (int c = 0; c < classes_; ++c) mixed[c] = low[c] + (high[c] - low[c]) * row.fraction;
    }
  }

  // The class with the largest resized logit at a pixel; of equal ones the lowest. NaN never wins; -1 if all are NaN.
  int best(const Tap& col) const {
    alignas(32) std::array<float, kMaxClasses> mixed;
    const float* low = values_.data() + size_t(col.low) * size_t(padded_);
    const float* high = values_.data() + size_t(col.high) * size_t(padded_);
    for (int c = 0; c < padded_; ++c) mixed[size_t(c)] = low[c] + (high[c] - low[c]) * col.fraction;
    return best_of(mixed.data(), classes_, padded_);
  }

 private:
  int classes_;
  int size_;
  int padded_;
  std::vector<float>& values_;
};

// exp(x) for x from -87 to 0 within 3e-7 of its value, without a call, so that a loop of it becomes vectors: 2^x by the
// whole part in the exponent and a polynomial (Taylor) for the rest, which lies within half a unit.
inline float exp_of_negative(float x) {
  constexpr float kLog2E = 1.44269504f, kLn2 = 0.69314718f,
                  kRound = 12582912.0f;  // 1.5 * 2^23: rounds what it is added to
  const float scaled = x * kLog2E;
  const float whole = (scaled + kRound) - kRound;
  const float rest = (scaled - whole) * kLn2;
  float sum = 1.0f / 720.0f;
  for (const float factor : {1.0f / 120.0f, 1.0f / 24.0f, 1.0f / 6.0f, 0.5f, 1.0f, 1.0f}) sum = sum * rest + factor;
  const int32_t bits = (int32_t(whole) + 127) << 23;
  float power;
  std::memcpy(&power, &bits, sizeof power);
  return sum * power;
}

// Of each cell log(p / (1 - p)), p the probability that it shows the person, whichever part: the logits of all coarse
// classes but the background, summed as probabilities, against the background's. A class that is NaN counts as absent.
MAQ_SIMD_CLONES void person_log_odds(const DenseLogits& logits, std::vector<float>& odds) {
  const int parts = logits.coarse_classes - 1;
  const int padded = round_up(parts, kLanes);
  alignas(64) std::array<float, kMaxClasses> values;
  values.fill(kSentinelLogit);
  const auto clamped = [](float logit) {
    const float low = logit > kSentinelLogit ? logit : kSentinelLogit;  // also where it is NaN
    return low < -kSentinelLogit ? low : -kSentinelLogit;
  };
  odds.resize(size_t(logits.size) * size_t(logits.size));
  for (int y = 0; y < logits.size; ++y) {
    for (int x = 0; x < logits.size; ++x) {
      const float* classes = logits.cell(y, x);
      for (int c = 0; c < parts; ++c) values[size_t(c)] = clamped(classes[1 + c]);
      std::array<float, kLanes> lane_max;
      lane_max.fill(kSentinelLogit);
      for (int c = 0; c < padded; c += kLanes) {
        for (int lane = 0; lane < kLanes; ++lane) {
          const float value = values[size_t(c + lane)];
          lane_max[size_t(lane)] = value > lane_max[size_t(lane)] ? value : lane_max[size_t(lane)];
        }
      }
      const float best = *std::max_element(lane_max.begin(), lane_max.end());
      std::array<float, kLanes> sums{};
      for (int c = 0; c < padded; c += kLanes) {
        for (int lane = 0; lane < kLanes; ++lane) {
          const float below = values[size_t(c + lane)] - best;
          sums[size_t(lane)] += exp_of_negative(below > -87.0f ? below : -87.0f);
        }
      }
      float sum = 0;
      for (const float part_sum : sums) sum += part_sum;
      odds[size_t(y) * size_t(logits.size) + size_t(x)] =
          best == kSentinelLogit ? kSentinelLogit : best + std::log(sum) - clamped(classes[0]);
    }
  }
}

// Of each cell the part with the largest logit, from 0 (of equal ones the lowest); -1 if all are NaN.
MAQ_SIMD_CLONES void best_parts(const DenseLogits& logits, std::vector<int8_t>& best) {
  const int parts = logits.index_classes - 1;
  const int padded = round_up(parts, kLanes);
  std::array<float, kMaxClasses> values;
  values.fill(kSentinelLogit);
  best.resize(size_t(logits.size) * size_t(logits.size));
  for (int y = 0; y < logits.size; ++y) {
    for (int x = 0; x < logits.size; ++x) {
      std::copy_n(logits.cell(y, x) + logits.coarse_classes + 1, parts, values.begin());
      best[size_t(y) * size_t(logits.size) + size_t(x)] = int8_t(best_of(values.data(), parts, padded));
    }
  }
}

float bilinear(const float* plane, int size, const Tap& row, const Tap& col) {
  const float* low = plane + size_t(row.low) * size_t(size);
  const float* high = plane + size_t(row.high) * size_t(size);
  const float left = low[col.low] + (high[col.low] - low[col.low]) * row.fraction;
  const float right = low[col.high] + (high[col.high] - low[col.high]) * row.fraction;
  return left + (right - left) * col.fraction;
}

// U and V between the four cells around a pixel. Neighbouring pixels mostly lie between the same ones.
class ChartSampler {
 public:
  ChartSampler(ChartValues& charts, const Tap& row) : charts_(charts), row_(row) {}

  ChartPoint at(int part, const Tap& col) {
    if (part != part_ || col.low != column_) {
      part_ = part;
      column_ = col.low;
      left_ = between(charts_.at(part, row_.low, col.low), charts_.at(part, row_.high, col.low), row_.fraction);
      right_ = between(charts_.at(part, row_.low, col.high), charts_.at(part, row_.high, col.high), row_.fraction);
    }
    return between(left_, right_, col.fraction);
  }

 private:
  static ChartPoint between(const ChartPoint& a, const ChartPoint& b, float fraction) {
    return {a.u + (b.u - a.u) * fraction, a.v + (b.v - a.v) * fraction};
  }

  ChartValues& charts_;
  const Tap& row_;
  int part_ = -1;
  int column_ = -1;
  ChartPoint left_, right_;
};

// 0 to 255; NaN becomes 0.
uint8_t to_byte(float value, bool* clamped) {
  if (!(value >= 0.0f)) {
    *clamped = true;
    return 0;
  }
  if (value > 1.0f) {
    *clamped = true;
    return 255;
  }
  return uint8_t(value * 255.0f + 0.5f);
}

}  // namespace

void DensePlanes::reset(int width, int height) {
  width_px = width;
  height_px = height;
  for (std::vector<uint8_t>* plane : {&part, &u, &v, &person}) plane->assign(size_t(width) * size_t(height), 0);
}

PixelRect pixel_rect(const Box& box) {
  const int x = int(std::floor(box.x0));
  const int y = int(std::floor(box.y0));
  return {x, y, std::max(1, int(std::floor(box.x1)) - x), std::max(1, int(std::floor(box.y1)) - y)};
}

MAQ_SIMD_CLONES DecodeCounts paint_person(const DenseLogits& logits, const Box& box, uint8_t person,
                                          float mask_threshold, float min_visible_fraction, DecodeMemory& memory,
                                          DensePlanes& planes) {
  DecodeCounts counts;
  int64_t taken = 0;  // pixels of the person that belong to people in front
  const PixelRect rect = pixel_rect(box);
  auto& [rows, cols, odds, best, mixed_row] = memory;
  fill_taps(logits.size, rect.height, rows);
  fill_taps(logits.size, rect.width, cols);
  person_log_odds(logits, odds);
  const float min_odds = std::log(mask_threshold / (1 - mask_threshold));
  ClassRow parts(logits.index_classes - 1, logits.size, mixed_row);  // all but the background
  best_parts(logits, best);

  const int first_row = std::max(0, -rect.y);
  const int last_row = std::min(rect.height, planes.height_px - rect.y);
  const int first_col = std::max(0, -rect.x);
  const int last_col = std::min(rect.width, planes.width_px - rect.x);
  for (int y = first_row; y < last_row; ++y) {
    const Tap& row = rows[size_t(y)];
    std::optional<ChartSampler> charts;
    if (logits.charts != nullptr) charts.emplace(*logits.charts, row);
    bool filled = false;  // many rows of a box need no resized logits
    const int8_t* best_low = best.data() + size_t(row.low) * size_t(logits.size);
    const int8_t* best_high = best.data() + size_t(row.high) * size_t(logits.size);
    for (int x = first_col; x < last_col; ++x) {
      const size_t pixel = size_t(rect.y + y) * size_t(planes.width_px) + size_t(rect.x + x);
      const Tap& col = cols[size_t(x)];
      if (!(bilinear(odds.data(), logits.size, row, col) > min_odds)) continue;
      if (planes.person[pixel] != 0) {
        ++taken;
        continue;
      }
      // What is largest in all four cells around a pixel is so between them.
      int part = best_low[col.low] + 1;
      if (part == 0 || best_low[col.high] + 1 != part || best_high[col.low] + 1 != part ||
          best_high[col.high] + 1 != part) {
        if (!filled) parts.fill(logits, logits.coarse_classes + 1, row);
        filled = true;
        part = parts.best(col) + 1;
        if (part == 0) continue;
      }
      bool clamped = false;
      planes.part[pixel] = uint8_t(part);
      if (charts) {
        const ChartPoint point = charts->at(part - 1, col);
        planes.u[pixel] = to_byte(point.u, &clamped);
        planes.v[pixel] = to_byte(point.v, &clamped);
      }
      planes.person[pixel] = person;
      ++counts.body_pixels;
      counts.clamped_uv += clamped ? 1 : 0;
    }
  }
  if (float(counts.body_pixels) >= min_visible_fraction * float(counts.body_pixels + taken)) return counts;
  for (int y = first_row; y < last_row; ++y) {
    const size_t start = size_t(rect.y + y) * size_t(planes.width_px) + size_t(rect.x);
    for (size_t pixel = start + size_t(first_col); pixel < start + size_t(last_col); ++pixel) {
      if (planes.person[pixel] != person) continue;
      for (std::vector<uint8_t>* plane : {&planes.part, &planes.u, &planes.v, &planes.person}) (*plane)[pixel] = 0;
    }
  }
  return {};
}

}  // namespace maq
