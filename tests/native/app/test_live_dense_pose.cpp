#include <gtest/gtest.h>

#include <app/live_densepose.h>

#include <atomic>
#include <chrono>
#include <future>
#include <mutex>
#include <thread>

#include "support/temp_folder.h"

namespace {

const std::string kTinyBundle = MAQ_TEST_DATA "/tiny_bundle";
const std::string kPhoto = "image:" MAQ_TEST_MEDIA "/photo.jpg";

maquette::LiveOptions as_fast_as_it_goes(uint64_t max_results) {
  maquette::LiveOptions options;
  options.real_time = false;
  options.max_results = max_results;
  options.reconnect_ms = 300;
  return options;
}

// Collects the pipeline's output and waits until a condition holds.
class Live {
 public:
  explicit Live(const maquette::LiveOptions& options = {}, const std::string& bundle = kTinyBundle)
      : live(
            context, config_of(bundle), [this](maquette::PipelineResult result, double) { keep(std::move(result)); },
            nullptr, options) {}

  static maq_densepose_config config_of(const std::string& bundle) {
    maq_densepose_config config = maquette::default_densepose_config();
    config.model.bundle_path = bundle.c_str();
    return config;
  }

  template <class Condition>
  bool until(Condition condition) {
    for (int i = 0; i < 12000; ++i) {
      if (condition()) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    return false;
  }
  bool until_ended() {
    return until([&] { return live.status().has_ended; });
  }
  uint64_t frames() const {
    std::lock_guard<std::mutex> lock(mutex_);
    return numbers_.size();
  }
  std::vector<uint64_t> sequences() const {
    std::lock_guard<std::mutex> lock(mutex_);
    return sequences_;
  }
  std::vector<int32_t> widths() const {
    std::lock_guard<std::mutex> lock(mutex_);
    return widths_;
  }

  maquette::Context context;

 private:
  void keep(maquette::PipelineResult result) {
    std::lock_guard<std::mutex> lock(mutex_);
    numbers_.push_back(result.number);
    sequences_.push_back(result.frame.desc().sequence);
    widths_.push_back(result.frame.desc().width_px);
    EXPECT_EQ(result.number, numbers_.size());
    EXPECT_EQ(maquette::densepose_of(result).width_px(), result.frame.desc().width_px);
  }

  mutable std::mutex mutex_;
  std::vector<uint64_t> numbers_, sequences_;
  std::vector<int32_t> widths_;

 public:
  maquette::LiveDensePose live;  // last: it uses the others
};

TEST(LiveDensePose, MapsEveryFrameOfAClipWhenItNeedNotKeepTime) {
  Live people(as_fast_as_it_goes(0));
  people.live.open("stub:pattern?frames=7&size=64x48");
  ASSERT_TRUE(people.until_ended());
  EXPECT_EQ(people.sequences(), (std::vector<uint64_t>{0, 1, 2, 3, 4, 5, 6}));
  EXPECT_EQ(people.live.status().problem, "");
  EXPECT_FALSE(people.live.status().has_failed);
}

TEST(LiveDensePose, PlaysAClipInRealTimeAgainAndAgain) {
  Live people;
  people.live.open("stub:pattern?frames=5&fps=50&size=64x48");
  ASSERT_TRUE(people.until([&] { return people.frames() >= 12; }));
  EXPECT_FALSE(people.live.status().has_ended);
}

TEST(LiveDensePose, LargePicturesOfFilesAreMadeSmaller) {
  maquette::LiveOptions options;
  options.max_side_px = 100;
  Live people(options);
  people.live.open(kPhoto);
  ASSERT_TRUE(people.until_ended());
  ASSERT_EQ(people.frames(), 1u);
  EXPECT_LE(people.widths()[0], 100);
  EXPECT_GT(people.widths()[0], 30);
}

TEST(LiveDensePose, LateReportsOfTheSourceBeforeAreNotOfTheNewOne) {
  std::promise<void> hold;
  const std::shared_future<void> released = hold.get_future().share();
  std::atomic<int> results{0};
  const maquette::Context context;
  maquette::LiveDensePose live(context, Live::config_of(kTinyBundle), [&](const maquette::PipelineResult&, double) {
    if (++results == 1) released.wait();
  });
  const auto until = [](auto condition) {
    for (int i = 0; i < 12000 && !condition(); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(5));
    return condition();
  };
  live.open("stub:pattern?fps=50&size=64x48");
  const bool is_held = until([&] { return results == 1; });
  live.set_paused(true);  // reported later, since the pipeline is held
  live.set_paused(false);
  live.open("stub:pattern?fps=50&size=32x32");
  hold.set_value();
  ASSERT_TRUE(is_held);
  const std::vector<maq_pipeline_state> expected{MAQ_PIPELINE_OPENING, MAQ_PIPELINE_RUNNING};
  EXPECT_TRUE(until([&] { return results > 3 && live.status().states == expected; }));
}

TEST(LiveDensePose, EndsAfterAsManyResultsAsItWasAskedFor) {
  Live people(as_fast_as_it_goes(4));
  people.live.open("stub:pattern?size=32x32");
  ASSERT_TRUE(people.until_ended());
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  EXPECT_EQ(people.frames(), 4u);
  EXPECT_FALSE(people.live.status().has_failed);
}

TEST(LiveDensePose, WhatCannotBeOpenedIsSaidAndReplaced) {
  Live people(as_fast_as_it_goes(0));
  people.live.open("image:/none.jpg", "stub:pattern?frames=3&size=32x32");
  ASSERT_TRUE(people.until_ended());
  EXPECT_EQ(people.frames(), 3u);
  EXPECT_NE(people.live.status().problem.find("/none.jpg does not exist"), std::string::npos);
  EXPECT_FALSE(people.live.status().has_failed);

  people.live.open("image:/none.jpg");
  ASSERT_TRUE(people.until([&] { return people.live.status().has_failed; }));
  EXPECT_NE(people.live.status().problem.find("/none.jpg does not exist"), std::string::npos);
}

TEST(LiveDensePose, APathIsMadeAUriAndAUriStaysAsItIs) {
  const TempFolder folder;
  const std::string odd = folder.file("50%? a:b.jpg");
  write_text(odd, "");
  EXPECT_EQ(maquette::source_uri(odd), "file:" + folder.file("50%25%3F a:b.jpg"));
  EXPECT_EQ(maquette::source_uri("missing.jpg"), "file:missing.jpg");
  EXPECT_EQ(maquette::source_uri("stub:people?count=2"), "stub:people?count=2");
  EXPECT_EQ(maquette::source_uri("camera:"), "camera:");
}

TEST(LiveDensePose, CallsReturnWhileItWorks) {
  std::mutex held;
  std::atomic<bool> is_waiting{false};
  const maquette::Context context;
  maquette::LiveDensePose live(context, Live::config_of(kTinyBundle), [&](const maquette::PipelineResult&, double) {
    is_waiting = true;
    const std::lock_guard<std::mutex> lock(held);
  });
  std::unique_lock<std::mutex> lock(held);
  live.open("stub:pattern?size=32x32");
  while (!is_waiting) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  // Its thread stands still: a call that waited for it would never return.
  for (int i = 0; i < 3; ++i) {
    live.open("stub:people?seed=" + std::to_string(i) + "&size=64x48");
    live.set_model(Live::config_of(kTinyBundle));
    live.set_paused(i % 2 == 0);
    live.set_recording("");
    EXPECT_EQ(live.status().state, MAQ_PIPELINE_OPENING);
    EXPECT_TRUE(!live.body() || live.body()->nodes > 1);
  }
}

}  // namespace
