#include <gtest/gtest.h>

#include <app/prediction/live_prediction.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <vector>

#include "support/wait_until.h"

namespace {

// The frames from the thread.
class PredictionRun {
 public:
  explicit PredictionRun(const maquette::PredictionChoice& choice = {}, bool real_time = false)
      : live(
            context, choice, [this](const maquette::PredictionFrame& frame) { keep(frame); }, nullptr,
            options(real_time)) {}

  std::vector<maquette::PredictionFrame> seen() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return seen_;
  }
  // A copy of the latest alone; number 0: none yet.
  maquette::PredictionFrame last() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return seen_.empty() ? maquette::PredictionFrame() : seen_.back();
  }
  bool until_ended() {
    return wait_until([&] { return live.status().has_ended; });
  }

  maquette::Context context;

 private:
  static maquette::LiveOptions options(bool real_time) {
    maquette::LiveOptions options;
    options.real_time = real_time;
    options.reconnect_ms = 300;
    return options;
  }
  void keep(const maquette::PredictionFrame& frame) {
    const std::lock_guard<std::mutex> lock(mutex_);
    seen_.push_back(frame);
  }

  mutable std::mutex mutex_;
  std::vector<maquette::PredictionFrame> seen_;

 public:
  maquette::LivePrediction live;  // last: it uses the others
};

double difference(const maquette::RgbaImage& one, const maquette::RgbaImage& other) {
  double sum = 0;
  for (size_t i = 0; i < one.rgba.size(); ++i) sum += std::abs(int(one.rgba[i]) - int(other.rgba[i]));
  return sum / double(one.rgba.size());
}

TEST(LivePrediction, ShowsWhatComesBesideWhatIs) {
  maquette::PredictionChoice choice;
  choice.method = MAQ_PREDICTOR_MOTION;
  PredictionRun run(choice);
  run.live.open("stub:people?size=160x120&frames=6");
  ASSERT_TRUE(run.until_ended());
  EXPECT_EQ(run.live.status().problem, "");
  const auto seen = run.seen();
  ASSERT_EQ(seen.size(), 6u);
  EXPECT_EQ(difference(seen[0].now, seen[0].next), 0) << "of one frame, no motion is known";
  EXPECT_GT(difference(seen[5].now, seen[5].next), 0.1);
  EXPECT_EQ(seen[5].stats.method, MAQ_PREDICTOR_MOTION);
  EXPECT_EQ(seen[5].number, 6u);
}

TEST(LivePrediction, TheCameraIsCheckedWithEachFrameWhileItIsWanted) {
  maquette::PredictionChoice choice;
  choice.checks_camera = true;
  PredictionRun run(choice);
  run.live.open("stub:people?size=160x120&frames=12");
  ASSERT_TRUE(run.until_ended());
  const maquette::PredictionFrame last = run.seen().back();
  ASSERT_EQ(last.health.size(), 12u);
  EXPECT_EQ(last.health[0].result.is_stream_start, 1);
  EXPECT_EQ(last.health[11].result.is_stream_start, 0);
  EXPECT_EQ(last.health[11].result.event, MAQ_CAMERA_OK);
  EXPECT_GT(last.health[11].time_s, last.health[10].time_s);
  const maq_camera_health_result& result = last.health[11].result;
  EXPECT_EQ(last.health_map.size(), size_t(result.rows) * size_t(result.columns));
  EXPECT_GT(last.health_ms, 0);
  choice.checks_camera = false;
  run.live.set_choice(choice);
  run.live.open("stub:people?size=160x120&frames=3");
  ASSERT_TRUE(wait_until([&] { return run.seen().size() == 15; }));
  EXPECT_TRUE(run.seen().back().health.empty());
  EXPECT_TRUE(run.seen().back().health_map.empty());
}

maquette::PredictionChoice sampling_choice() {
  maquette::PredictionChoice choice;
  choice.shows_entropy = choice.shows_sample = true;
  choice.bundle = MAQ_TEST_DATA "/tiny_transformer/bundle";
  return choice;
}

TEST(LivePrediction, EachFrameHasEntropyAndASampleWhereFramesWait) {
  PredictionRun run(sampling_choice());
  run.live.open("stub:people?size=320x240&frames=6");
  ASSERT_TRUE(run.until_ended());
  EXPECT_EQ(run.live.status().problem, "");
  const auto seen = run.seen();
  ASSERT_EQ(seen.size(), 6u);
  for (const auto& frame : seen) {
    EXPECT_EQ(frame.sampled.number, frame.number);
    EXPECT_EQ(frame.sample_age_ms, 0);
    EXPECT_EQ(frame.sampled.ahead_s, 0.2);
    EXPECT_EQ(frame.sampled.bits.size(), 256u);
    EXPECT_EQ(frame.sampled.image.width_px, 256);
    EXPECT_EQ(frame.sampled.image.height_px, 192);
  }
  const auto most = [](const std::vector<float>& bits) { return *std::max_element(bits.begin(), bits.end()); };
  EXPECT_EQ(most(seen[0].sampled.bits), 0) << "of one frame, no motion is known";
  EXPECT_GT(most(seen[5].sampled.bits), 0.1f);
  EXPECT_GT(difference(seen[4].sampled.image, seen[5].sampled.image), 0);

  maquette::PredictionChoice choice = sampling_choice();
  choice.shows_sample = false;
  run.live.set_choice(choice);
  ASSERT_TRUE(wait_until([&] { return run.seen().back().sampled.image.empty(); }));
  EXPECT_EQ(run.seen().back().sampled.bits, seen[5].sampled.bits);
  EXPECT_EQ(run.seen().back().number, 6u) << "the same frame";
}

TEST(LivePrediction, ASampleBesideALiveStreamHasItsAge) {
  maquette::PredictionChoice choice = sampling_choice();
  choice.ahead_s = 0.1;
  PredictionRun run(choice, true);
  run.live.open("stub:people?size=64x48&fps=30");
  // No frame waits for it.
  ASSERT_TRUE(wait_until([&] {
    const maquette::PredictionFrame frame = run.last();
    return frame.sampled.number > 0 && frame.sample_age_ms > 30;
  }));
  for (const auto& frame : run.seen()) EXPECT_GE(frame.sample_age_ms, 0);
  run.live.set_paused(true);
  choice.ahead_s = 0.05;
  run.live.set_choice(choice);
  ASSERT_TRUE(wait_until([&] { return run.last().sampled.ahead_s == 0.05; })) << "also while it is paused";
  EXPECT_LT(run.last().sample_age_ms, 70) << "of the latest frame, or one of those left out after it";
  choice.shows_entropy = choice.shows_sample = false;
  run.live.set_choice(choice);
  run.live.set_paused(false);
  ASSERT_TRUE(wait_until([&] { return run.last().sampled.number == 0; }));
}

TEST(LivePrediction, WithoutSamplingNetworksTheImageGoesOn) {
  maquette::PredictionChoice choice = sampling_choice();
  choice.bundle = MAQ_TEST_DATA "/tiny_prediction/bundle";
  PredictionRun run(choice);
  run.live.open("stub:people?size=160x120&frames=3");
  ASSERT_TRUE(run.until_ended());
  EXPECT_FALSE(run.live.status().has_failed);
  EXPECT_NE(run.live.status().problem.find("tiny-prediction has no network for sampled"), std::string::npos)
      << run.live.status().problem;
  EXPECT_EQ(run.seen().size(), 3u);
  EXPECT_EQ(run.seen().back().sampled.number, 0u);
}

TEST(LivePrediction, AnotherTimeAheadIsSeenAfterTheEndToo) {
  maquette::PredictionChoice choice;
  choice.method = MAQ_PREDICTOR_MOTION;
  choice.ahead_s = 0;
  PredictionRun run(choice);
  run.live.open("stub:people?size=160x120&frames=4");
  ASSERT_TRUE(run.until_ended());
  ASSERT_EQ(run.seen().size(), 4u);
  choice.ahead_s = 0.3;
  run.live.set_choice(choice);
  ASSERT_TRUE(wait_until([&] { return run.seen().size() == 5; }));
  EXPECT_EQ(difference(run.seen()[3].now, run.seen()[4].now), 0);
  EXPECT_GT(difference(run.seen()[3].next, run.seen()[4].next), 0.1);
  EXPECT_EQ(run.seen()[4].ahead_s, 0.3);
}

TEST(LivePrediction, GapsAreFilledAndMarkedAndPredictionContinuesFromTheCapturedFrame) {
  maquette::PredictionChoice choice;
  choice.conceals_gaps = true;
  PredictionRun run(choice, true);
  // Frames are lost for as long as it takes: under a sanitizer this thread may be too slow for the first gaps.
  run.live.open("stub:people?size=160x120&fps=5&drop=0.3");
  const auto made_up = [&] {
    for (const auto& frame : run.seen()) {
      if (frame.origin.kind == MAQ_FRAME_PREDICTED && frame.number > 1) return std::optional(frame);
    }
    return std::optional<maquette::PredictionFrame>();
  };
  ASSERT_TRUE(wait_until([&] { return made_up().has_value(); }));
  EXPECT_TRUE(made_up()->conceals_gaps);
  EXPECT_GT(made_up()->gaps.predicted_count, 0u);
  EXPECT_GT(made_up()->predicted_ahead_s, made_up()->ahead_s + 0.05);
}

TEST(LivePrediction, WithoutTheSwitchNothingIsMadeUp) {
  PredictionRun run({}, true);
  run.live.open("stub:people?size=160x120&fps=20&stall=300ms@500ms&loop=0&frames=20");
  ASSERT_TRUE(run.until_ended());
  for (const auto& frame : run.seen()) EXPECT_EQ(frame.origin.kind, MAQ_FRAME_CAPTURED);
}

TEST(LivePrediction, WhatCannotBeShownIsSaidAndTheFallbackPlays) {
  PredictionRun run;
  run.live.open("image:/none.png");
  ASSERT_TRUE(run.until_ended());
  EXPECT_TRUE(run.live.status().has_failed);
  EXPECT_NE(run.live.status().problem.find("/none.png"), std::string::npos);
  run.live.open("image:" MAQ_TEST_MEDIA "/box_depth.png?depth_unit=0.001&fov=60");
  ASSERT_TRUE(wait_until([&] {
    const maquette::LiveStatus status = run.live.status();
    return status.has_failed && status.problem.find("/none.png") == std::string::npos;
  }));
  EXPECT_NE(run.live.status().problem.find("epth"), std::string::npos) << run.live.status().problem;
  run.live.open("image:/none.png", "stub:people?size=160x120&frames=2");
  ASSERT_TRUE(run.until_ended());
  EXPECT_FALSE(run.live.status().has_failed);
  EXPECT_NE(run.live.status().problem.find("/none.png"), std::string::npos);
  EXPECT_EQ(run.live.status().uri, "stub:people?size=160x120&frames=2");
  EXPECT_EQ(run.seen().size(), 2u);
}

TEST(LivePrediction, CloseLetsTheSourceGoAndRecordingsHaveCapturedFrames) {
  const std::string path = testing::TempDir() + "/live_prediction.maqrec";
  std::filesystem::remove(path);
  maquette::PredictionChoice choice;
  choice.conceals_gaps = true;
  PredictionRun run(choice, true);
  run.live.open("stub:people?size=160x120&fps=10&drop=0.2");
  run.live.set_recording(path);
  ASSERT_TRUE(wait_until([&] { return run.seen().size() >= 20 && run.seen().back().gaps.predicted_count > 0; }));
  run.live.close();
  EXPECT_EQ(run.live.status().uri, "");
  const size_t count = run.seen().size();
  maquette::Source recording(run.context, "rec:" + path);
  size_t recorded = 0;
  while (const auto frame = recording.next()) {
    EXPECT_FALSE(frame->is_predicted());
    ++recorded;
  }
  EXPECT_GT(recorded, 5u);
  EXPECT_LT(recorded, count);
}

}  // namespace
