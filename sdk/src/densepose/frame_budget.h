// Keeps the time of dense pose for a frame within a budget while a device throttles. The caller reports how long frames
// took; quality() says how the next ones are computed. First people are detected in fewer frames, then the input of the
// networks becomes smaller. Both return when there has been time to spare for a while.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include "core/clock.h"

namespace maq {

// The settings of dense pose that decide how long a frame takes.
struct DensePoseQuality {
  int key_frame_interval = 1;
  int long_side_px = 0;  // of the networks' input
};

class FrameBudget {
 public:
  // `full`: the settings of the app; the budget begins with them and never exceeds them.
  FrameBudget(double budget_ms, const DensePoseQuality& full);

  // Adds a frame of a stream: when it was done, and how long it took. Returns true if quality() changed. Times do not
  // go back.
  bool add(MonotonicClock::time_point time, double run_ms);

  const DensePoseQuality& quality() const { return levels_[level_]; }

 private:
  // Judges twenty frames at a time, by the median of five means of four frames. Each mean has its share of key frames,
  // and moments in which another program ran spoil few of the five.
  static constexpr size_t kMeans = 5, kFramesOfMean = 4;

  bool judge(MonotonicClock::time_point time, double frame_ms);
  double cost_of(size_t level) const;
  bool go_to(size_t level);

  const double budget_ms_;
  std::vector<DensePoseQuality> levels_;  // each costs less than the one before
  size_t level_ = 0;
  std::array<double, kMeans> sums_ms_{};
  size_t frames_ = 0;       // in these
  bool skips_next_ = true;  // the first of a level: memory is planned anew for it
  bool went_up_ = false;    // by the latest change
  MonotonicClock::duration patience_;
  std::optional<MonotonicClock::time_point> has_time_since_;
};

}  // namespace maq
