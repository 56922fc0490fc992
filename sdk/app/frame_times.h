// How long a window's thread took for its frames, for the report of a run without a user.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace maquette {

class FrameTimes {
 public:
  // Times are in seconds of one clock.
  explicit FrameTimes(double now_s) : start_s_(now_s) {}

  // A frame that began at `begin_s` is on the screen now. The first counts from when this was made.
  void add(double begin_s, double now_s) {
    if (start_ms_ == 0) {
      start_ms_ = (now_s - start_s_) * 1000;
    } else if (ms_.size() < kMaxFrames) {
      ms_.push_back(float((now_s - begin_s) * 1000));
    }
  }

  double start_ms() const { return start_ms_; }  // to the first frame
  size_t count() const { return ms_.size(); }
  // 0 without any.
  double percentile_ms(size_t percent) const {
    std::vector<float> sorted = ms_;
    std::sort(sorted.begin(), sorted.end());
    return sorted.empty() ? 0 : double(sorted[(sorted.size() - 1) * percent / 100]);
  }

 private:
  static constexpr size_t kMaxFrames = 1000000;
  const double start_s_;
  double start_ms_ = 0;
  std::vector<float> ms_;
};

}  // namespace maquette
