// Time that only goes forward: CLOCK_MONOTONIC, which std::chrono::steady_clock reads on Linux. Times of capture are of
// this clock (MAQ_CLOCK_MONOTONIC).
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>

namespace maq {

using MonotonicClock = std::chrono::steady_clock;

inline int64_t to_ns(MonotonicClock::time_point time) {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(time.time_since_epoch()).count();
}

inline int64_t monotonic_ns() { return to_ns(MonotonicClock::now()); }

// When a wait of `timeout_ns` from now ends. Beyond a century the sum would leave the range of this clock, or of the
// system's clock, which older C++ libraries use to wait.
inline MonotonicClock::time_point deadline_after(int64_t timeout_ns) {
  constexpr int64_t kMaxTimeoutNs = int64_t(100) * 365 * 24 * 3600 * 1000000000;
  return MonotonicClock::now() + std::chrono::nanoseconds(std::min(timeout_ns, kMaxTimeoutNs));
}

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
