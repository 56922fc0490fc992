// Measures a running app: the times of its frames, its CPU time and its memory.
#pragma once

#include <sys/resource.h>
#include <unistd.h>
#include <algorithm>
#include <chrono>
#include <cstddef>
#include <fstream>
#include <vector>

namespace maquette {

// The times that a window's thread took for its frames, for the report of a run without a user.
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

// The CPU time and memory that this process uses, for a panel.
class ProcessLoad {
 public:
  // Measures at most once a second; the first time a second after this was made.
  void update() {
    const auto now = std::chrono::steady_clock::now();
    const double passed_s = std::chrono::duration<double>(now - measured_at_).count(), used_s = cpu_s();
    if (passed_s < 1) return;
    cpu_percent_ = 100 * (used_s - cpu_s_) / passed_s;
    measured_at_ = now, cpu_s_ = used_s;
    long pages = 0, resident = 0;
    std::ifstream("/proc/self/statm") >> pages >> resident;
    memory_mb_ = double(resident) * double(sysconf(_SC_PAGESIZE)) / 1e6;
  }
  double cpu_percent() const { return cpu_percent_; }  // of one core, over the last second
  double memory_mb() const { return memory_mb_; }      // resident; 0 until measured

 private:
  // User and system, of all threads.
  static double cpu_s() {
    rusage used{};
    getrusage(RUSAGE_SELF, &used);
    const auto seconds = [](const timeval& time) { return double(time.tv_sec) + double(time.tv_usec) * 1e-6; };
    return seconds(used.ru_utime) + seconds(used.ru_stime);
  }

  std::chrono::steady_clock::time_point measured_at_ = std::chrono::steady_clock::now();
  double cpu_s_ = cpu_s(), cpu_percent_ = 0, memory_mb_ = 0;
};

}  // namespace maquette
