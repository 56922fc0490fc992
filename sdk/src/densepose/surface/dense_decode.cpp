#include "densepose/surface/dense_decode.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "core/rounding.h"
#include "core/simd_clones.h"

namespace maq {
namespace {

constexpr int kMaxClasses = 64;
// Sentinel below every logit of a network: a missing class. Finite, so that interpolating it gives no NaN; logits are
// clamped to [kSentinelLogit, -kSentinelLogit].
constexpr float kSentinelLogit = -1e30f;
constexpr int kLanes = 8;

using Tap = ResizeTap;

// Between the centres of which two of `cells` cells a coordinate lies; before the first and behind the last, at it.
inline Tap tap_at(float coordinate, int cells) {
  const float at = std::max(0.0f, coordinate - 0.5f);
  const int low = std::min(int(at), cells - 1);
  return {low, std::min(low + 1, cells - 1), at - float(low)};
}

// Where each pixel of `to` lies between two cells of `from`.
void fill_taps(int from, int to, std::vector<Tap>& taps) {
  taps.resize(static_cast<size_t>(to));
  const float scale = float(from) / float(to);
  for (int i = 0; i < to; ++i) taps[size_t(i)] = tap_at((float(i) + 0.5f) * scale, from);
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

// Computes log(p / (1 - p)) of each cell, p the probability that it shows the person, whichever part: the logits of all
// coarse classes but the background, summed as probabilities, against the background's. A class that is NaN counts as
// absent.
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

// Finds the part of each cell with the largest logit, from 0 (of equal ones the lowest); -1 if all are NaN.
MAQ_SIMD_CLONES void best_parts(const DenseLogits& logits, std::vector<int16_t>& best) {
  const int parts = logits.index_classes - 1;
  const int padded = round_up(parts, kLanes);
  std::array<float, kMaxClasses> values;
  values.fill(kSentinelLogit);
  best.resize(size_t(logits.size) * size_t(logits.size));
  for (int y = 0; y < logits.size; ++y) {
    for (int x = 0; x < logits.size; ++x) {
      std::copy_n(logits.cell(y, x) + logits.coarse_classes + 1, parts, values.begin());
      best[size_t(y) * size_t(logits.size) + size_t(x)] = int16_t(best_of(values.data(), parts, padded));
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

// The part with the largest logit between four cells, as ClassRow gives it.
inline int best_between(const DenseLogits& logits, const Tap& row, const Tap& column) {
  const int parts = logits.index_classes - 1, padded = round_up(parts, kLanes);
  const int first = logits.coarse_classes + 1;
  const float* const cells[] = {logits.cell(row.low, column.low) + first, logits.cell(row.high, column.low) + first,
                                logits.cell(row.low, column.high) + first, logits.cell(row.high, column.high) + first};
  alignas(32) std::array<float, kMaxClasses> mixed;
  mixed.fill(kSentinelLogit);
  for (int c = 0; c < parts; ++c) {
    const float left = cells[0][c] + (cells[1][c] - cells[0][c]) * row.fraction;
    const float right = cells[2][c] + (cells[3][c] - cells[2][c]) * row.fraction;
    mixed[size_t(c)] = left + (right - left) * column.fraction;
  }
  return best_of(mixed.data(), parts, padded);
}

// The pixels of the planes whose centres may lie in the `size` x `size` cells.
PixelRect rotated_rect(const AffineMap& to_image, int size, const DensePlanes& planes) {
  const double side = size;
  Point low = to_image({0, 0}), high = low;
  for (const Point& corner : {to_image({side, 0}), to_image({0, side}), to_image({side, side})}) {
    low = {std::min(low.x, corner.x), std::min(low.y, corner.y)};
    high = {std::max(high.x, corner.x), std::max(high.y, corner.y)};
  }
  const auto clipped = [](double at, int side_px) { return int(std::clamp(at, 0.0, double(side_px))); };
  const int x = clipped(std::floor(low.x), planes.width_px), y = clipped(std::floor(low.y), planes.height_px);
  return {x, y, clipped(std::ceil(high.x), planes.width_px) - x, clipped(std::ceil(high.y), planes.height_px) - y};
}

// Paints one person into the planes, pixel by pixel.
class Painter {
 public:
  // `rect`: what is painted into, which may reach beyond the planes.
  Painter(const DenseLogits& logits, const PixelRect& rect, uint8_t person, float mask_threshold, DecodeMemory& memory,
          DensePlanes& planes)
      : size_(logits.size),
        person_(person),
        min_odds_(min_log_odds(mask_threshold)),
        memory_(memory),
        planes_(planes),
        first_row_(std::max(0, rect.y)),
        end_row_(std::min(rect.y + rect.height, planes.height_px)),
        first_column_(std::max(0, rect.x)),
        end_column_(std::min(rect.x + rect.width, planes.width_px)) {
    classify_cells(logits, memory);
    memory_.painted_odds.resize(planes.person.size());
    memory_.won.clear();
  }

  int first_row() const { return first_row_; }
  int end_row() const { return end_row_; }
  int first_column() const { return first_column_; }
  int end_column() const { return end_column_; }

  // The pixel of the planes that lies at `row` and `column` of the cells. `part_between`: the best part there, from 0,
  // -1 for none; asked only where the cells around do not agree.
  template <class PartBetween>
  void paint(int x, int y, const Tap& row, const Tap& column, ChartSampler* charts, PartBetween&& part_between) {
    const float odds = bilinear(memory_.odds.data(), size_, row, column);
    if (!(odds > min_odds_)) return;
    const size_t pixel = size_t(y) * size_t(planes_.width_px) + size_t(x);
    if (planes_.person[pixel] != 0) {
      ++taken_;
      if (in_eighths(odds) > memory_.painted_odds[pixel]) win(x, y);
      return;
    }
    paint_pixel(pixel, odds, row, column, charts, part_between);
  }

  // Takes everything back where other people leave less than that fraction of the person. Otherwise `memory.won` has
  // the pixels that other people are to lose.
  DecodeCounts finish(float min_visible_fraction);

  // Paints the pixels of `memory.won`; `to_cells` maps positions of the image to the cells.
  DecodeCounts paint_won(const DenseLogits& logits, const AffineMap& to_cells);

 private:
  [[gnu::noinline]] void win(int x, int y) { memory_.won.push_back({x, y}); }
  void keep_visible(float min_visible_fraction);
  size_t owner_of(const DecodeMemory::Pixel& pixel) const {
    return planes_.person[size_t(pixel.y) * size_t(planes_.width_px) + size_t(pixel.x)];
  }

  static int8_t in_eighths(float odds) { return int8_t(std::floor(std::clamp(8 * odds, -127.0f, 127.0f) + 0.5f)); }

  template <class PartBetween>
  void paint_pixel(size_t pixel, float odds, const Tap& row, const Tap& column, ChartSampler* charts,
                   PartBetween&& part_between) {
    // A part that is largest in all four cells around a pixel is the largest between them.
    const int16_t* const low = memory_.best.data() + size_t(row.low) * size_t(size_);
    const int16_t* const high = memory_.best.data() + size_t(row.high) * size_t(size_);
    int part = low[column.low];
    if (part < 0 || low[column.high] != part || high[column.low] != part || high[column.high] != part) {
      part = part_between();
      if (part < 0) return;
    }
    bool clamped = false;
    planes_.part[pixel] = uint8_t(part + 1);
    if (charts != nullptr) {
      const ChartPoint point = charts->at(part, column);
      planes_.u[pixel] = to_byte(point.u, &clamped);
      planes_.v[pixel] = to_byte(point.v, &clamped);
    }
    planes_.person[pixel] = person_;
    memory_.painted_odds[pixel] = in_eighths(odds);
    ++counts_.body_pixels;
    counts_.clamped_uv += clamped ? 1 : 0;
  }

  int size_;
  uint8_t person_;
  float min_odds_;
  DecodeMemory& memory_;
  DensePlanes& planes_;
  int first_row_, end_row_, first_column_, end_column_;
  DecodeCounts counts_;
  int64_t taken_ = 0;  // pixels of the person that belonged to other people
};

[[gnu::noinline]] DecodeCounts Painter::finish(float min_visible_fraction) {
  if (float(counts_.body_pixels) >= min_visible_fraction * float(counts_.body_pixels + taken_)) {
    keep_visible(min_visible_fraction);
    memory_.pixel_count[person_] = counts_.body_pixels;
    return counts_;
  }
  memory_.won.clear();
  for (int y = first_row_; y < end_row_; ++y) {
    const size_t start = size_t(y) * size_t(planes_.width_px);
    for (size_t pixel = start + size_t(first_column_); pixel < start + size_t(end_column_); ++pixel) {
      if (planes_.person[pixel] != person_) continue;
      for (std::vector<uint8_t>* plane : {&planes_.part, &planes_.u, &planes_.v, &planes_.person}) (*plane)[pixel] = 0;
    }
  }
  return {};
}

// Nobody loses so many pixels that less than this fraction remains.
void Painter::keep_visible(float min_visible_fraction) {
  memory_.lost_count.fill(0);
  for (const DecodeMemory::Pixel& pixel : memory_.won) ++memory_.lost_count[owner_of(pixel)];
  const auto is_kept = [&](const DecodeMemory::Pixel& pixel) {
    const size_t owner = owner_of(pixel);
    const int64_t had = memory_.pixel_count[owner];
    return float(had - memory_.lost_count[owner]) < min_visible_fraction * float(had);
  };
  memory_.won.erase(std::remove_if(memory_.won.begin(), memory_.won.end(), is_kept), memory_.won.end());
  for (const DecodeMemory::Pixel& pixel : memory_.won) --memory_.pixel_count[owner_of(pixel)];
}

// Not inlined: a few pixels are not worth code for each kind of processor.
[[gnu::noinline]] DecodeCounts Painter::paint_won(const DenseLogits& logits, const AffineMap& to_cells) {
  for (const DecodeMemory::Pixel& at : memory_.won) {
    const Point cell = to_cells({at.x + 0.5, at.y + 0.5});
    const Tap row = tap_at(float(cell.y), logits.size), column = tap_at(float(cell.x), logits.size);
    std::optional<ChartSampler> charts;
    if (logits.charts != nullptr) charts.emplace(*logits.charts, row);
    paint_pixel(size_t(at.y) * size_t(planes_.width_px) + size_t(at.x),
                bilinear(memory_.odds.data(), size_, row, column), row, column, charts ? &*charts : nullptr,
                [&] { return best_between(logits, row, column); });
  }
  counts_.won_pixels = int64_t(memory_.won.size());
  memory_.pixel_count[person_] = counts_.body_pixels;
  return counts_;
}

}  // namespace

void DensePlanes::reset(int width, int height) {
  width_px = width;
  height_px = height;
  for (std::vector<uint8_t>* plane : {&part, &u, &v, &person}) plane->assign(size_t(width) * size_t(height), 0);
}

std::optional<Box> head_bounds(const DensePlanes& planes, uint8_t person) {
  constexpr uint8_t kHeadRight = 23, kHeadLeft = 24;
  int left = planes.width_px, top = planes.height_px, right = 0, bottom = 0;
  for (int y = 0; y < planes.height_px; ++y) {
    const size_t row = size_t(y) * size_t(planes.width_px);
    for (int x = 0; x < planes.width_px; ++x) {
      const uint8_t part = planes.part[row + size_t(x)];
      if ((part != kHeadRight && part != kHeadLeft) || planes.person[row + size_t(x)] != person) continue;
      left = std::min(left, x), right = std::max(right, x + 1);
      top = std::min(top, y), bottom = y + 1;
    }
  }
  if (right == 0) return std::nullopt;
  return Box{float(left), float(top), float(right), float(bottom)};
}

PixelRect pixel_rect(const Box& box) {
  const int x = int(std::floor(box.x0));
  const int y = int(std::floor(box.y0));
  return {x, y, std::max(1, int(std::floor(box.x1)) - x), std::max(1, int(std::floor(box.y1)) - y)};
}

void classify_cells(const DenseLogits& logits, DecodeMemory& memory) {
  person_log_odds(logits, memory.odds);
  best_parts(logits, memory.best);
}

MAQ_SIMD_CLONES float part_confidence(const DenseLogits& logits, float mask_threshold, const DecodeMemory& memory) {
  const int parts = logits.index_classes - 1;
  const float min_odds = min_log_odds(mask_threshold);
  double sum = 0;
  int count = 0;
  for (int row = 0; row < logits.size; ++row) {
    for (int column = 0; column < logits.size; ++column) {
      const size_t cell = size_t(row) * size_t(logits.size) + size_t(column);
      if (!(memory.odds[cell] > min_odds) || memory.best[cell] < 0) continue;
      const float* const values = logits.cell(row, column) + logits.coarse_classes + 1;
      const float best = values[memory.best[cell]];
      float total = 0;
      for (int c = 0; c < parts; ++c) {
        const float below = values[c] - best;
        total += below > -87.0f ? exp_of_negative(below) : 0;  // 0 also for NaN
      }
      sum += double(1 / total);
      ++count;
    }
  }
  return count == 0 ? 0 : float(sum / count);
}

float min_log_odds(float mask_threshold) { return std::log(mask_threshold / (1 - mask_threshold)); }

MAQ_SIMD_CLONES DecodeCounts paint_person(const DenseLogits& logits, const Box& box, uint8_t person,
                                          float mask_threshold, float min_visible_fraction, DecodeMemory& memory,
                                          DensePlanes& planes) {
  const PixelRect rect = pixel_rect(box);
  fill_taps(logits.size, rect.height, memory.rows);
  fill_taps(logits.size, rect.width, memory.columns);
  Painter painter(logits, rect, person, mask_threshold, memory, planes);
  ClassRow parts(logits.index_classes - 1, logits.size, memory.mixed_row);  // all but the background
  for (int y = painter.first_row(); y < painter.end_row(); ++y) {
    const Tap& row = memory.rows[size_t(y - rect.y)];
    std::optional<ChartSampler> charts;
    if (logits.charts != nullptr) charts.emplace(*logits.charts, row);
    bool filled = false;  // many rows of a box need no resized logits
    for (int x = painter.first_column(); x < painter.end_column(); ++x) {
      const Tap& column = memory.columns[size_t(x - rect.x)];
      painter.paint(x, y, row, column, charts ? &*charts : nullptr, [&] {
        if (!filled) parts.fill(logits, logits.coarse_classes + 1, row);
        filled = true;
        return parts.best(column);
      });
    }
  }
  const DecodeCounts counts = painter.finish(min_visible_fraction);
  if (memory.won.empty()) return counts;
  AffineMap to_cells;
  to_cells.xx = double(logits.size) / rect.width, to_cells.shift_x = -rect.x * to_cells.xx;
  to_cells.yy = double(logits.size) / rect.height, to_cells.shift_y = -rect.y * to_cells.yy;
  return painter.paint_won(logits, to_cells);
}

MAQ_SIMD_CLONES DecodeCounts paint_rotated_person(const DenseLogits& logits, const AffineMap& to_cells, uint8_t person,
                                                  float mask_threshold, float min_visible_fraction,
                                                  DecodeMemory& memory, DensePlanes& planes) {
  const float size = float(logits.size);
  Painter painter(logits, rotated_rect(to_cells.inverse(), logits.size, planes), person, mask_threshold, memory,
                  planes);
  for (int y = painter.first_row(); y < painter.end_row(); ++y) {
    for (int x = painter.first_column(); x < painter.end_column(); ++x) {
      const Point cell = to_cells({x + 0.5, y + 0.5});
      const float cell_x = float(cell.x), cell_y = float(cell.y);
      if (!(cell_x >= 0 && cell_x <= size && cell_y >= 0 && cell_y <= size)) continue;
      const Tap row = tap_at(cell_y, logits.size), column = tap_at(cell_x, logits.size);
      std::optional<ChartSampler> charts;
      if (logits.charts != nullptr) charts.emplace(*logits.charts, row);
      painter.paint(x, y, row, column, charts ? &*charts : nullptr, [&] { return best_between(logits, row, column); });
    }
  }
  const DecodeCounts counts = painter.finish(min_visible_fraction);
  return memory.won.empty() ? counts : painter.paint_won(logits, to_cells);
}

}  // namespace maq
