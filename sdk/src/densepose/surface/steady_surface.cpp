#include "densepose/surface/steady_surface.h"

#include <algorithm>
#include <cmath>

#include "core/simd_clones.h"

namespace maq {
namespace {

// Views are similar if no corner is farther off than this part of their side.
constexpr double kSimilarView = 0.3;
// Changes at which the frame before counts half: of the log-odds of a person, and of brightness (0 to 255).
constexpr float kOtherOdds = 3, kOtherBrightness = 8;
// Cells with lower log-odds of a person are background, whatever they were before.
constexpr float kBackgroundOdds = -3;

float half_at(float change, float limit) { return 1 / (1 + (change / limit) * (change / limit)); }

// Computes about the log-odds that a cell shows a person, for each cell: row by row, NaN where a logit is NaN.
MAQ_SIMD_CLONES void find_odds(const DenseLogits& logits, std::vector<float>& odds) {
  odds.resize(size_t(logits.size) * size_t(logits.size));
  float* to = odds.data();
  for (int row = 0; row < logits.size; ++row) {
    for (int column = 0; column < logits.size; ++column) {
      const float* const cell = logits.cell(row, column);
      float best = cell[1];
      for (int c = 2; c < logits.coarse_classes; ++c) best = cell[c] > best ? cell[c] : best;
      *to++ = best - cell[0];
    }
  }
}

// Between which cells of a square of `size` a place lies, x first; nothing outside.
struct Between {
  bool is_inside;
  int column, row;
  float weights[4];  // of the cells at (row, column), (row, column + 1), (row + 1, column), (row + 1, column + 1)
};

Between between_cells(double x, double y, int size) {
  const float at_x = float(x) - 0.5f, at_y = float(y) - 0.5f, last = float(size - 1);
  if (!(at_x >= 0 && at_y >= 0 && at_x <= last && at_y <= last)) return {false, 0, 0, {}};
  const int column = std::min(int(at_x), size - 2), row = std::min(int(at_y), size - 2);
  const float right = at_x - float(column), low = at_y - float(row);
  return {true, column, row, {(1 - right) * (1 - low), right * (1 - low), (1 - right) * low, right * low}};
}

// Moves `values`, `count` for each source, towards what the sources say.
template <class Source>
MAQ_SIMD_CLONES void mix(const std::vector<Source>& sources, const float* before, int count, float* values) {
  for (const Source& source : sources) {
    if (source.share > 0) {
      // Nothing here lies in the same memory, so that compilers take vectors.
      const float* __restrict a = before + source.from[0];
      const float* __restrict b = before + source.from[1];
      const float* __restrict c = before + source.from[2];
      const float* __restrict d = before + source.from[3];
      float* __restrict to = values;
      const float of_a = source.weights[0], of_b = source.weights[1], of_c = source.weights[2],
                  of_d = source.weights[3], share = source.share;
      for (int k = 0; k < count; ++k) {
        const float was = a[k] * of_a + b[k] * of_b + c[k] * of_c + d[k] * of_d;
        const float change = share * (was - to[k]);
        to[k] += change == change ? change : 0;  // NaN of one frame is not kept
      }
    }
    values += count;
  }
}

}  // namespace

void SteadySurface::begin(const ImageView& image, bool follows_last) {
  if (!(steadiness_ > 0)) return;
  motion_.next(image, follows_last);
  previous_.swap(current_);
  previous_count_ = motion_.is_known() ? current_count_ : 0;
  current_count_ = 0;
}

const SteadySurface::Answer* SteadySurface::similar_to(const AffineMap& to_cells, int size) const {
  const AffineMap to_image = to_cells.inverse();
  const double side = size;
  const Answer* best = nullptr;
  double least = kSimilarView * side;
  for (size_t i = 0; i < previous_count_; ++i) {
    if (previous_[i].size != size) continue;
    double farthest = 0;
    for (const Point& corner : {Point{0, 0}, Point{side, 0}, Point{0, side}, Point{side, side}}) {
      const Point there = previous_[i].to_cells(to_image(corner));
      farthest = std::max({farthest, std::abs(there.x - corner.x), std::abs(there.y - corner.y)});
    }
    if (farthest < least) {
      least = farthest;
      best = &previous_[i];
    }
  }
  return best;
}

void SteadySurface::find_sources(const AffineMap& to_cells, const DenseLogits& logits, const Answer& before) {
  const AffineMap to_image = to_cells.inverse();
  const int size = logits.size, half = size / 2;
  DenseLogits old = logits;
  old.labels = before.labels.data();
  const size_t channels = before.surface.size() / (size_t(half) * size_t(half));
  of_labels_.resize(size_t(size) * size_t(size));
  of_surface_.assign(size_t(half) * size_t(half), {});
  is_placed_.assign(of_surface_.size(), 0);
  find_odds(logits, odds_);
  for (int row = 0; row < size; ++row) {
    for (int column = 0; column < size; ++column) {
      const float* const cell = logits.cell(row, column);
      const size_t classes = size_t(logits.coarse_classes + logits.index_classes);
      Source& source = of_labels_[size_t(cell - logits.labels) / classes];
      source = {};
      const float odds_now = odds_[size_t(row) * size_t(size) + size_t(column)];
      if (odds_now < kBackgroundOdds) continue;
      const Point image = to_image({column + 0.5, row + 0.5});
      const FrameMotion::Motion& motion = motion_.at(image);
      const Point was = before.to_cells({image.x - double(motion.x_px), image.y - double(motion.y_px)});
      const Between cells = between_cells(was.x, was.y, size);
      if (!cells.is_inside) continue;
      float odds = 0;
      for (int k = 0; k < 4; ++k) {
        const int from_row = cells.row + k / 2, from_column = cells.column + k % 2;
        source.from[k] = size_t(old.cell(from_row, from_column) - old.labels);
        source.weights[k] = cells.weights[k];
        odds += cells.weights[k] * before.odds[size_t(from_row) * size_t(size) + size_t(from_column)];
      }
      const float likeness = half_at(motion.mismatch, kOtherBrightness) * half_at(odds - odds_now, kOtherOdds);
      source.share = likeness > 0 ? steadiness_ * likeness : 0;  // 0 also where it is NaN
      // A cell of the surface covers four of the labels: the least share of them, at the place of the first.
      const size_t four = size_t(row / 2) * size_t(half) + size_t(column / 2);
      Source& coarse = of_surface_[four];
      if (is_placed_[four] != 0) {
        coarse.share = std::min(coarse.share, source.share);
        continue;
      }
      is_placed_[four] = 1;
      const double shift_x = was.x - (column + 0.5), shift_y = was.y - (row + 0.5);
      const int middle_x = column - column % 2 + 1, middle_y = row - row % 2 + 1;
      const Between places = between_cells((middle_x + shift_x) / 2, (middle_y + shift_y) / 2, half);
      if (!places.is_inside) continue;
      for (int k = 0; k < 4; ++k) {
        const size_t from = size_t(places.row + k / 2) * size_t(half) + size_t(places.column + k % 2);
        coarse.from[k] = from * channels;
        coarse.weights[k] = places.weights[k];
      }
      coarse.share = source.share;
    }
  }
}

void SteadySurface::steady(const AffineMap& to_cells, const DenseLogits& logits, float* labels, float* surface,
                           int channels) {
  if (!(steadiness_ > 0)) return;
  const int classes = logits.coarse_classes + logits.index_classes;
  const size_t cells = size_t(logits.size) * size_t(logits.size);
  const Answer* const before = similar_to(to_cells, logits.size);
  if (before != nullptr) {
    find_sources(to_cells, logits, *before);
    mix(of_labels_, before->labels.data(), classes, labels);
    mix(of_surface_, before->surface.data(), channels, surface);
  }
  if (current_.size() == current_count_) current_.emplace_back();
  Answer& kept = current_[current_count_++];
  kept.to_cells = to_cells;
  kept.size = logits.size;
  kept.labels.assign(labels, labels + cells * size_t(classes));
  find_odds(logits, kept.odds);
  kept.surface.assign(surface, surface + cells / 4 * size_t(channels));
}

}  // namespace maq
