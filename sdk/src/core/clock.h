// Time that only goes forward: CLOCK_MONOTONIC, which std::chrono::steady_clock reads on Linux. Times of capture are of
// this clock (MAQ_CLOCK_MONOTONIC).
#pragma once

#include <chrono>
#include <cstdint>

namespace maq {

using MonotonicClock = std::chrono::steady_clock;

inline int64_t to_ns(MonotonicClock::time_point time) {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(time.time_since_epoch()).count();
}

inline int64_t monotonic_ns() { return to_ns(MonotonicClock::now()); }

// Measures the stages of some work one after another.
class Stopwatch {
 public:
  double elapsed_ms() const {
    return std::chrono::duration<double, std::milli>(MonotonicClock::now() - start_).count();
  }

  // Since the last lap, or since the stopwatch was made.
  double lap_ms() {
    const auto now = MonotonicClock::now();
    const double ms = std::chrono::duration<double, std::milli>(now - start_).count();
    start_ = now;
    return ms;
  }

 private:
  MonotonicClock::time_point start_ = MonotonicClock::now();
};

// Adds the time from here to the end of the block to a sum.
class ScopedTimer {
 public:
  explicit ScopedTimer(double& sum_ms) : sum_ms_(sum_ms) {}
  ~ScopedTimer() { sum_ms_ += watch_.elapsed_ms(); }
  ScopedTimer(const ScopedTimer&) = delete;
  ScopedTimer& operator=(const ScopedTimer&) = delete;

 private:
  double& sum_ms_;
  const Stopwatch watch_;
};

}  // namespace maq
