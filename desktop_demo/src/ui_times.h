// How long the window's thread took for its frames.
#pragma once

#include <algorithm>
#include <nlohmann/json.hpp>
#include <vector>

#include "screen/window.h"

class UiTimes {
 public:
  // A frame that began then is on the screen now. The first counts from when this was made.
  void add_frame(double begin_s) {
    const double now_s = monotonic_s();
    if (start_ms_ == 0) {
      start_ms_ = (now_s - start_s_) * 1000;
    } else if (frame_ms_.size() < kMaxFrames) {
      frame_ms_.push_back(float((now_s - begin_s) * 1000));
    }
  }

  nlohmann::ordered_json report() const {
    std::vector<float> sorted = frame_ms_;
    std::sort(sorted.begin(), sorted.end());
    const auto rank = [&](size_t percent) { return sorted.empty() ? 0 : sorted[(sorted.size() - 1) * percent / 100]; };
    return {{"frames", sorted.size()}, {"longest_ms", rank(100)}, {"p99_ms", rank(99)}, {"start_ms", start_ms_}};
  }

 private:
  static constexpr size_t kMaxFrames = 1000000;
  const double start_s_ = monotonic_s();
  double start_ms_ = 0;
  std::vector<float> frame_ms_;
};
