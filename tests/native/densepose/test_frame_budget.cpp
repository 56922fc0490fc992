// The frame budget on simulated devices: run times by a model of its cost, a clock that counts them.
#include "densepose/frame_budget.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

namespace {

using std::chrono::duration_cast;
using std::chrono::milliseconds;
using std::chrono::nanoseconds;

constexpr double kBudgetMs = 33;
constexpr double kFullMs = 20;  // what a key frame takes at full size and speed

// A device with a camera of 30 frames a second.
class Device {
 public:
  explicit Device(maq::DensePoseQuality full = {1, 288}, double budget_ms = kBudgetMs)
      : full_px_(full.long_side_px), budget_(budget_ms, full) {}

  // Runs for `seconds`; `speed` of the device at a time since the start, 1 when it is cool.
  void run(double seconds, const std::function<double(double)>& speed) {
    for (const double end_s = now_s() + seconds; now_s() < end_s;) {
      const maq::DensePoseQuality quality = budget_.quality();
      const bool is_key = frame_++ % quality.key_frame_interval == 0;
      const double side = double(quality.long_side_px) / full_px_;
      // A third does not depend on the size of the input.
      const double cost = (is_key ? 1 : 0.8) * (0.33 + 0.67 * side * side);
      const double ms = kFullMs * cost / speed(now_s()) * noise_();
      now_ += duration_cast<nanoseconds>(std::chrono::duration<double, std::milli>(std::max(ms, 1000.0 / 30)));
      met_ = ms <= kBudgetMs ? met_ + 1 : 0;
      late_ += ms <= kBudgetMs ? 0 : 1;
      changes_ += budget_.add(maq::MonotonicClock::time_point(now_), ms) ? 1 : 0;
    }
  }
  void run(double seconds, double speed) {
    run(seconds, [=](double) { return speed; });
  }
  // Each frame takes up to that fraction more or less; one in `spike_every` four times as long.
  void make_noisy(double fraction, int spike_every) {
    noise_ = [=, random = std::mt19937(7)]() mutable {
      const double spread = 1 + fraction * (2.0 * double(random()) / double(std::mt19937::max()) - 1);
      return spike_every > 0 && int(random() % unsigned(spike_every)) == 0 ? 4 * spread : spread;
    };
  }

  double now_s() const { return std::chrono::duration<double>(now_).count(); }
  const maq::DensePoseQuality& quality() const { return budget_.quality(); }
  bool is_full() const { return quality().key_frame_interval == 1 && quality().long_side_px == full_px_; }
  int changes() const { return changes_; }
  int late() const { return late_; }
  int met_at_the_end() const { return met_; }  // frames in a row
  void forget() { changes_ = late_ = 0; }

 private:
  const int full_px_;
  maq::FrameBudget budget_;
  nanoseconds now_{0};
  std::function<double()> noise_ = [] { return 1.0; };
  int frame_ = 0, met_ = 0, late_ = 0, changes_ = 0;
};

TEST(FrameBudget, ADeviceThatKeepsUpIsLeftAlone) {
  Device device;
  device.make_noisy(0.2, 0);
  device.run(600, 1);
  EXPECT_TRUE(device.is_full());
  EXPECT_EQ(device.changes(), 0);
  EXPECT_EQ(device.late(), 0);
}

TEST(FrameBudget, KeyFramesBecomeRarerBeforeTheInputBecomesSmaller) {
  Device device;
  device.run(10, 20 / 31.0);  // 31 ms: a little too much
  EXPECT_GT(device.quality().key_frame_interval, 1);
  EXPECT_EQ(device.quality().long_side_px, 288);
  EXPECT_EQ(device.changes(), 1);
  device.run(10, 20 / 40.0);
  EXPECT_EQ(device.quality().key_frame_interval, 4);
  EXPECT_LT(device.quality().long_side_px, 288);
}

TEST(FrameBudget, AfterASuddenThrottleToAThirdDeadlinesAreMetAgainWithinTwoWindows) {
  Device device;
  device.run(5, 1);
  device.run(10, 1 / 3.0);
  EXPECT_LE(device.late(), 42) << "twenty frames of a window and the first after a change, twice";
  EXPECT_LE(device.changes(), 2);
  EXPECT_GE(device.met_at_the_end(), 200);
}

TEST(FrameBudget, WhileADeviceHeatsUpSlowlyFewFramesAreLate) {
  Device device;
  device.run(300, [](double time_s) { return 1 - 0.6 * time_s / 300; });
  EXPECT_LE(device.changes(), 10);
  EXPECT_LE(device.late(), 450)
      << "5 % of 9000: the mean is within the budget, and key frames may be a little above it";
}

TEST(FrameBudget, WhatWasLostComesBackStepByStepWhenTheDeviceIsCool) {
  Device device;
  device.run(10, 1 / 3.0);
  const maq::DensePoseQuality least = device.quality();
  device.forget();
  device.run(4, 1);
  EXPECT_EQ(device.quality().long_side_px, least.long_side_px) << "not before some seconds";
  device.run(8, 1);
  EXPECT_GT(device.quality().long_side_px, least.long_side_px);
  EXPECT_FALSE(device.is_full());
  device.run(60, 1);
  EXPECT_TRUE(device.is_full());
  EXPECT_LE(device.changes(), 6);
  EXPECT_EQ(device.late(), 0);
}

TEST(FrameBudget, OnAnySpeedItComesToRest) {
  for (int percent = 20; percent <= 100; percent += 2) {
    Device device;
    device.make_noisy(0.15, 0);
    device.run(120, percent / 100.0);
    device.forget();
    device.run(1200, percent / 100.0);
    EXPECT_LE(device.changes(), 2 * 1200 / 80 + 2) << percent << " %: one step up and back in 80 seconds";
  }
}

TEST(FrameBudget, FramesThatOtherProgramsDelayChangeLittle) {
  Device device;
  device.make_noisy(0.1, 50);
  device.run(300, 1);
  EXPECT_LE(device.changes(), 4) << "one frame in 50 takes four times as long";
}

TEST(FrameBudget, WhereNothingIsEnoughItStaysAtTheLeast) {
  Device device;
  device.run(60, 0.05);
  EXPECT_EQ(device.quality().key_frame_interval, 4);
  EXPECT_EQ(device.quality().long_side_px, 160) << "no less than half of 288";
  EXPECT_LE(device.changes(), 2);
}

TEST(FrameBudget, WhatTheAppAskedForIsNeverExceeded) {
  for (const maq::DensePoseQuality full : {maq::DensePoseQuality{8, 256}, {3, 200}, {1, 32}, {1000, 33}, {2, 2048}}) {
    Device device(full);
    device.run(30, 0.01);
    EXPECT_GE(device.quality().key_frame_interval, full.key_frame_interval);
    EXPECT_LE(device.quality().long_side_px, full.long_side_px);
    EXPECT_GE(2 * device.quality().long_side_px, full.long_side_px);
    device.run(3600, 100);
    EXPECT_EQ(device.quality().key_frame_interval, full.key_frame_interval);
    EXPECT_EQ(device.quality().long_side_px, full.long_side_px);
  }
}

}  // namespace
