// How many threads are chosen: by times alone, and by what runs of different lengths take.
#include "nn/thread_choice.h"

#include <gtest/gtest.h>

#include <chrono>
#include <limits>
#include <new>
#include <stdexcept>
#include <thread>

#include "core/error.h"

namespace {

using std::chrono_literals::operator""ms;

constexpr double kFailed = std::numeric_limits<double>::infinity();

TEST(ThreadChoice, TheFewestWithinFivePercentOfTheFastestAreTaken) {
  EXPECT_EQ(maq::choose_threads({10, 5}), 2);
  EXPECT_EQ(maq::choose_threads({10, 5, 3.4, 2.6}), 4);
  EXPECT_EQ(maq::choose_threads({10, 6, 5, 4.9}), 3);
  EXPECT_EQ(maq::choose_threads({10, 9.9, 9.8, 9.6}), 1);
  EXPECT_EQ(maq::choose_threads({10.4, 10}), 1);
  EXPECT_EQ(maq::choose_threads({10.6, 10}), 2);
}

TEST(ThreadChoice, MoreThreadsThatAreSlowerAreNotTaken) {
  EXPECT_EQ(maq::choose_threads({5, 9, 12, 20}), 1);
  EXPECT_EQ(maq::choose_threads({10, 6, 8, 9}), 2);
}

TEST(ThreadChoice, OfEqualTimesTheFewestThreadsAreTaken) {
  EXPECT_EQ(maq::choose_threads({4, 4, 4, 4}), 1);
  EXPECT_EQ(maq::choose_threads({8, 4, 4, 4}), 2);
  EXPECT_EQ(maq::choose_threads({0, 0}), 1) << "faster than the clock";
}

TEST(ThreadChoice, WhatFailedIsNotTaken) {
  EXPECT_EQ(maq::choose_threads({10, kFailed, 5, kFailed}), 3);
  EXPECT_EQ(maq::choose_threads({kFailed, 5}), 2);
  EXPECT_EQ(maq::choose_threads({10, std::numeric_limits<double>::quiet_NaN()}), 1);
  EXPECT_EQ(maq::choose_threads({kFailed, kFailed}), 1);
}

TEST(ThreadChoice, TheFasterNumberIsFoundByTheClock) {
  const auto open = [](int threads) -> maq::TimedRun {
    return [threads] {
      if (threads != 2) std::this_thread::sleep_for(20ms);
    };
  };
  EXPECT_EQ(maq::measure_threads(3, open), 2);
}

TEST(ThreadChoice, EachRunsInTurnAndIsGoneAfterwards) {
  std::vector<int> order;
  std::vector<std::weak_ptr<int>> opened;
  maq::measure_threads(3, [&](int threads) -> maq::TimedRun {
    const auto session = std::make_shared<int>(threads);
    opened.push_back(session);
    return [session, &order] { order.push_back(*session); };
  });
  ASSERT_EQ(opened.size(), 3u);
  for (const auto& session : opened) EXPECT_TRUE(session.expired());
  ASSERT_GE(order.size(), 2u * 3);
  ASSERT_EQ(order.size() % 3, 0u);
  for (size_t i = 0; i < order.size(); ++i) EXPECT_EQ(order[i], int(i % 3) + 1);
}

TEST(ThreadChoice, SlowOnesRunOnceEachAfterTheWarmUp) {
  std::vector<int> runs(4);
  maq::measure_threads(4, [&](int threads) -> maq::TimedRun {
    return [&runs, threads] {
      ++runs[size_t(threads) - 1];
      std::this_thread::sleep_for(130ms);
    };
  });
  EXPECT_EQ(runs, std::vector<int>(4, 2));
}

TEST(ThreadChoice, NumbersThatFailAreLeftOut) {
  int runs = 0;
  const auto open = [&](int threads) -> maq::TimedRun {
    if (threads == 3) throw maq::Error(MAQ_ERROR_INFERENCE, "No.");
    if (threads == 4) throw std::bad_alloc();
    if (threads == 1) return [] { std::this_thread::sleep_for(10ms); };
    return [&runs] {
      if (++runs == 3) throw maq::Error(MAQ_ERROR_INFERENCE, "No longer.");
    };
  };
  EXPECT_EQ(maq::measure_threads(4, open), 1);
  EXPECT_EQ(runs, 3) << "none after the failure";
}

TEST(ThreadChoice, WhatOneThreadThrowsIsThrown) {
  EXPECT_THROW(maq::measure_threads(2, [](int) -> maq::TimedRun { throw maq::Error(MAQ_ERROR_BAD_BUNDLE, "No."); }),
               maq::Error);
  EXPECT_THROW(maq::measure_threads(
                   2, [](int) -> maq::TimedRun { return [] { throw maq::Error(MAQ_ERROR_INFERENCE, "No."); }; }),
               maq::Error);
}

}  // namespace
