// Keeps the time that the model takes for a frame within a budget while a device throttles: it is told how long frames
// took, and says what the next ones may cost. First people are detected in fewer frames, then the networks' input
// becomes smaller; both come back when there has been time to spare for a while.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include "core/clock.h"

namespace maq {

// What the model does for a frame.
struct FrameEffort {
  int key_frame_interval = 1;
  int long_side_px = 0;  // of the networks' input
};

class FrameBudget {
 public:
  // `full`: what the app asked for, where it begins and what is never exceeded.
  FrameBudget(double budget_ms, const FrameEffort& full);

  // After each frame of a stream: when it was done, and how long the model took. True where effort() changed, for the
  // frames to come. Times do not go back.
  bool add(MonotonicClock::time_point time, double run_ms);

  const FrameEffort& effort() const { return levels_[level_]; }

 private:
  // Frames are judged twenty at a time, by the median of five means of four: a mean has its share of key frames, and
  // moments in which something else ran spoil few of the five.
  static constexpr size_t kMeans = 5, kFramesOfMean = 4;

  bool judge(MonotonicClock::time_point time, double frame_ms);
  double cost_of(size_t level) const;
  bool go_to(size_t level);

  const double budget_ms_;
  std::vector<FrameEffort> levels_;  // each costs less than the one before
  size_t level_ = 0;
  std::array<double, kMeans> sums_ms_{};
  size_t frames_ = 0;       // in these
  bool skips_next_ = true;  // the first of a level: memory is planned anew for it
  bool went_up_ = false;    // by the latest change
  MonotonicClock::duration patience_;
  std::optional<MonotonicClock::time_point> has_time_since_;
};

}  // namespace maq
