#include "densepose/surface/steady_labels.h"

#include <algorithm>

namespace maq {
namespace {

// Added to the logit of the label before. Chosen on photographs with noise and shake: larger values leave labels that
// have become wrong.
constexpr float kFavourPart = 1.0f, kFavourPerson = 1.0f;

bool is_same(const AffineMap& a, const AffineMap& b) {
  return a.xx == b.xx && a.xy == b.xy && a.shift_x == b.shift_x && a.yx == b.yx && a.yy == b.yy &&
         a.shift_y == b.shift_y;
}

}  // namespace

void SteadyLabels::begin(bool is_stream) {
  previous_.swap(current_);
  previous_count_ = is_stream ? current_count_ : 0;
  current_count_ = 0;
}

void SteadyLabels::favour(const AffineMap& view, const DenseLogits& logits, float* labels) const {
  const auto end = previous_.begin() + int64_t(previous_count_);
  const auto kept = std::find_if(previous_.begin(), end, [&](const Kept& one) { return is_same(one.view, view); });
  if (kept == end || kept->parts.size() != size_t(logits.size) * size_t(logits.size)) return;
  for (int row = 0; row < logits.size; ++row) {
    for (int column = 0; column < logits.size; ++column) {
      float* const cell = labels + (logits.cell(row, column) - logits.labels);
      const int part = kept->parts[size_t(row) * size_t(logits.size) + size_t(column)];
      cell[0] += part < 0 ? kFavourPerson : -kFavourPerson;
      if (part >= 0) cell[logits.coarse_classes + 1 + part] += kFavourPart;
    }
  }
}

void SteadyLabels::keep(const AffineMap& view, float mask_threshold, const DecodeMemory& painted) {
  if (current_.size() == current_count_) current_.emplace_back();
  Kept& kept = current_[current_count_++];
  kept.view = view;
  kept.parts.resize(painted.best.size());
  const float min_odds = min_log_odds(mask_threshold);
  for (size_t i = 0; i < kept.parts.size(); ++i)
    kept.parts[i] = painted.odds[i] > min_odds ? painted.best[i] : int16_t(-1);
}

}  // namespace maq
