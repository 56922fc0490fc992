#include "densepose/frame_budget.h"

#include <algorithm>

namespace maq {
namespace {

constexpr int kKeyFrameIntervals[] = {2, 4};
constexpr int kSideStepPx = 32;  // multiple to which networks pad their input
// Fractions of the budget: above the first, less work is done; if the expected time is below the second, more. The
// extra time of key frames and noise lie between them.
constexpr double kFull = 0.9, kHasTime = 0.8;
// How long there must be time before more is done. Twice as long after each time that this had to be taken back: a
// phone that is warm throttles again at once.
constexpr std::chrono::seconds kPatience(5), kMaxPatience(80);

// Returns the mean cost of a frame if one in `interval` is a key frame, as measured (docs/research/dense-pose.md).
double cost_of_key_frames(int interval) { return interval >= 4 ? 0.87 : interval >= 2 ? 0.93 : 1; }

}  // namespace

FrameBudget::FrameBudget(double budget_ms, const DensePoseQuality& full)
    : budget_ms_(budget_ms), levels_{full}, patience_(kPatience) {
  for (const int interval : kKeyFrameIntervals) {
    if (interval > full.key_frame_interval) levels_.push_back({interval, full.long_side_px});
  }
  const int interval = levels_.back().key_frame_interval;
  const int largest = (full.long_side_px - 1) / kSideStepPx * kSideStepPx;
  for (int side = largest; side >= kSideStepPx && 2 * side >= full.long_side_px; side -= kSideStepPx) {
    levels_.push_back({interval, side});
  }
}

bool FrameBudget::add(MonotonicClock::time_point time, double run_ms) {
  if (skips_next_) {
    skips_next_ = false;
    return false;
  }
  sums_ms_[frames_ / kFramesOfMean] += run_ms;
  if (++frames_ < kMeans * kFramesOfMean) return false;
  std::nth_element(sums_ms_.begin(), sums_ms_.begin() + kMeans / 2, sums_ms_.end());
  const double frame_ms = sums_ms_[kMeans / 2] / double(kFramesOfMean);
  sums_ms_ = {};
  frames_ = 0;
  return judge(time, frame_ms);
}

bool FrameBudget::judge(MonotonicClock::time_point time, double frame_ms) {
  if (frame_ms > kFull * budget_ms_) {
    has_time_since_.reset();
    size_t next = level_ + 1;
    const auto expected_ms = [&](size_t level) { return frame_ms * cost_of(level) / cost_of(level_); };
    while (next + 1 < levels_.size() && expected_ms(next) > kFull * budget_ms_) ++next;
    if (next >= levels_.size()) return false;
    if (went_up_) patience_ = std::min<MonotonicClock::duration>(2 * patience_, kMaxPatience);
    went_up_ = false;
    return go_to(next);
  }
  if (level_ == 0 || frame_ms * cost_of(level_ - 1) / cost_of(level_) > kHasTime * budget_ms_) {
    has_time_since_.reset();
    return false;
  }
  if (!has_time_since_) has_time_since_ = time;
  if (time - *has_time_since_ < patience_) return false;
  has_time_since_.reset();
  if (went_up_) patience_ = kPatience;  // the step before was right
  went_up_ = true;
  return go_to(level_ - 1);
}

// Relative to other levels. Of the input's size only a part grows with the area, and heads and decoding not at all.
double FrameBudget::cost_of(size_t level) const {
  return cost_of_key_frames(levels_[level].key_frame_interval) * levels_[level].long_side_px;
}

bool FrameBudget::go_to(size_t level) {
  level_ = level;
  skips_next_ = true;
  return true;
}

}  // namespace maq
