// Which frames before the transformer is shown, by their times.
#include <gtest/gtest.h>

#include <limits>
#include <random>
#include <vector>

#include "prediction/transformer/code_history.h"

namespace {

constexpr int64_t kPeriod_ns = 33333333;

// A history of frames with one code each, their number.
maq::CodeHistory history_of(const std::vector<int64_t>& times_ns) {
  maq::CodeHistory history(1);
  for (size_t i = 0; i < times_ns.size(); ++i) {
    const auto code = uint16_t(i);
    history.add(&code, times_ns[i]);
  }
  return history;
}

// Numbers of the three frames that are shown, the oldest first; -1 for none.
std::vector<int> shown(const maq::CodeHistory& history, int64_t coming_ns) {
  const uint16_t* frames[3];
  history.select(coming_ns, 3, frames);
  std::vector<int> numbers;
  for (const uint16_t* const frame : frames) numbers.push_back(frame == nullptr ? -1 : int(*frame));
  return numbers;
}

std::vector<int64_t> at(const std::vector<int>& periods) {
  std::vector<int64_t> times_ns;
  for (const int period : periods) times_ns.push_back(period * kPeriod_ns);
  return times_ns;
}

using Numbers = std::vector<int>;

TEST(CodeHistory, OfAnEvenStreamTheLatestFramesAreShown) {
  EXPECT_EQ(shown(history_of({}), 0), (Numbers{-1, -1, -1}));
  EXPECT_EQ(shown(history_of(at({0})), kPeriod_ns), (Numbers{-1, -1, 0}));
  EXPECT_EQ(shown(history_of(at({0, 1})), 2 * kPeriod_ns), (Numbers{-1, 0, 1}));
  std::vector<int64_t> times_ns;
  for (int i = 0; i < 40; ++i) times_ns.push_back(i * kPeriod_ns);
  EXPECT_EQ(shown(history_of(times_ns), 40 * kPeriod_ns), (Numbers{37, 38, 39}));
}

TEST(CodeHistory, JitterOfAThirdOfAPeriodChangesNothing) {
  std::mt19937 random(1);
  std::uniform_int_distribution<int64_t> jitter(-kPeriod_ns / 12, kPeriod_ns / 12);
  for (int round = 0; round < 200; ++round) {
    std::vector<int64_t> times_ns;
    for (int i = 0; i <= 10; ++i) times_ns.push_back(i * kPeriod_ns + jitter(random));
    const int64_t coming_ns = times_ns.back();
    times_ns.pop_back();
    ASSERT_EQ(shown(history_of(times_ns), coming_ns), (Numbers{7, 8, 9}));
  }
}

TEST(CodeHistory, WhereFramesAreMissingThoseOfTheRightTimesAreShown) {
  // Period 7 is missing: the newest is two periods old, so that frames of two periods apart are shown.
  EXPECT_EQ(shown(history_of(at({0, 1, 2, 3, 4, 5, 6})), 8 * kPeriod_ns), (Numbers{2, 4, 6}));
  // A missing frame is null, and so are the frames before it.
  EXPECT_EQ(shown(history_of(at({0, 1, 2, 4, 5})), 6 * kPeriod_ns), (Numbers{-1, 3, 4}));
  EXPECT_EQ(shown(history_of(at({0, 1, 2, 5})), 6 * kPeriod_ns), (Numbers{-1, -1, 3}));
}

TEST(CodeHistory, EqualTimesAndTheEndsOfTimeAreHarmless) {
  EXPECT_EQ(shown(history_of({5, 5, 5}), 5), (Numbers{0, 1, 2}));
  constexpr int64_t kMin_ns = std::numeric_limits<int64_t>::min(), kMax_ns = std::numeric_limits<int64_t>::max();
  EXPECT_EQ(shown(history_of({kMin_ns, kMin_ns + 10}), kMin_ns + 20), (Numbers{-1, 0, 1}));
  EXPECT_EQ(shown(history_of({kMax_ns - 20, kMax_ns - 10}), kMax_ns), (Numbers{-1, 0, 1}));
  maq::CodeHistory history = history_of({1, 2});
  history.clear();
  EXPECT_EQ(shown(history, 3), (Numbers{-1, -1, -1}));
}

}  // namespace
