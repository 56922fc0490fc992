// Live sources with gaps, bridged: order, rate, marks, the longest gap, the ends.
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <future>
#include <maquette/maquette.hpp>
#include <optional>
#include <string>
#include <thread>
#include <vector>

namespace {

constexpr int64_t kPatience_ns = 20000000000;
constexpr int64_t kPeriod_ns = 33333333;

std::string latest_text() { return maq_last_error(nullptr); }

struct Seen {
  maq_frame_desc desc;
  maq_frame_origin origin;
  bool is_predicted() const { return origin.kind == MAQ_FRAME_PREDICTED; }
};

class Concealer : public testing::Test {
 protected:
  maquette::Source open(const std::string& uri, const maq_source_config* config = nullptr) const {
    return maquette::Source(context_, uri, config);
  }
  maq_concealer_config config(int32_t max_gap_ms = 300) const {
    maq_concealer_config config = maquette::default_concealer_config();
    config.threads = 1;
    config.max_gap_ms = max_gap_ms;
    config.method = MAQ_PREDICTOR_LAST;  // fast enough for the rates here with sanitizers, too
    return config;
  }
  // Until `count` captured frames have come.
  static std::vector<Seen> take(maquette::Concealer& concealer, int count) {
    std::vector<Seen> all;
    while (count > 0) {
      const auto frame = concealer.next(kPatience_ns);
      if (!frame) break;
      all.push_back({frame->desc(), frame->origin()});
      count -= all.back().is_predicted() ? 0 : 1;
    }
    return all;
  }
  // Later from frame to frame; predicted ones within the longest gap, and of the captured frame before them.
  static int check(const std::vector<Seen>& all, int max_gap_ms) {
    int predicted = 0;
    for (size_t i = 0; i < all.size(); ++i) {
      if (i > 0) {
        EXPECT_GT(all[i].desc.timestamp_ns, all[i - 1].desc.timestamp_ns) << i;
      }
      if (!all[i].is_predicted()) continue;
      ++predicted;
      EXPECT_LE(all[i].origin.horizon_ns, int64_t(max_gap_ms) * 1000000);
      EXPECT_GT(all[i].origin.horizon_ns, 0);
      EXPECT_EQ(all[i].origin.captured_timestamp_ns + all[i].origin.horizon_ns, all[i].desc.timestamp_ns);
      EXPECT_EQ(all[i].desc.sequence, all[i].origin.captured_sequence);
    }
    return predicted;
  }

  const maquette::Context context_;
};

TEST_F(Concealer, AStallOf200MsIsBridgedAtTheSourcesRate) {
  maquette::Source source = open("stub:people?fps=30&size=64x48&stall=200ms@30");
  maq_concealer_config by_motion = config();
  by_motion.method = MAQ_PREDICTOR_AUTO;
  maquette::Concealer concealer(context_, source, by_motion);
  const std::vector<Seen> all = take(concealer, 40);
  const int predicted = check(all, 300);
  EXPECT_GE(predicted, 3);
  const maq_concealer_stats stats = concealer.stats();
  EXPECT_GE(stats.predicted_count, uint64_t(predicted));
  EXPECT_GE(stats.captured_count, 40u);
  EXPECT_GT(stats.latest_gap_ms, 0);
  EXPECT_GE(stats.max_wait_ms, stats.latest_wait_ms);
  // Compares times, not clocks: within the stall they go on at the rate.
  int bridged = 0;
  for (size_t i = 1; i < all.size(); ++i) {
    if (all[i].is_predicted() && all[i - 1].is_predicted()) {
      EXPECT_NEAR(double(all[i].desc.timestamp_ns - all[i - 1].desc.timestamp_ns), kPeriod_ns, kPeriod_ns * 0.2);
      ++bridged;
    }
  }
  EXPECT_GE(bridged, 2);
}

TEST_F(Concealer, AfterTheLongestGapTheSourcesOwnStatusComes) {
  maquette::Source source = open("stub:people?fps=30&size=64x48&stall=2s@20");
  maquette::Concealer concealer(context_, source, config(150));
  int timeouts = 0, captured = 0;
  std::vector<Seen> all;
  while (captured < 40) {
    maq_frame* taken = nullptr;
    const maq_status status = maq_concealer_acquire_frame(concealer.get(), 100000000, &taken);
    if (status == MAQ_TIMEOUT) {
      ++timeouts;
      continue;
    }
    ASSERT_EQ(status, MAQ_OK) << latest_text();
    const maquette::Frame frame(taken);
    all.push_back({frame.desc(), frame.origin()});
    captured += all.back().is_predicted() ? 0 : 1;
  }
  EXPECT_GE(check(all, 150), 1);
  EXPECT_GT(timeouts, 5) << "the stall goes on for long after";
}

TEST_F(Concealer, DroppedAndJitteringFramesKeepOrderAndMarks) {
  for (const char* faults : {"drop=0.2", "jitter=20ms", "drop=0.1&jitter=10ms&corrupt=0.05"}) {
    maquette::Source source = open(std::string("stub:people?fps=60&size=64x48&fault_seed=3&") + faults);
    maquette::Concealer concealer(context_, source, config());
    const std::vector<Seen> all = take(concealer, 60);
    const int predicted = check(all, 300);
    EXPECT_GT(predicted, 0) << faults;
  }
}

TEST_F(Concealer, ACameraThatIsLostIsReportedAfterTheGap) {
  maq_source_config how = maquette::default_source_config();
  how.reconnect_ms = 400;
  maquette::Source source = open("stub:people?fps=30&size=64x48&unplug@1s", &how);
  maquette::Concealer concealer(context_, source, config());
  int64_t longest_ns = 0;
  maq_status status = MAQ_OK;
  while (status == MAQ_OK) {
    maq_frame* taken = nullptr;
    status = maq_concealer_acquire_frame(concealer.get(), kPatience_ns, &taken);
    if (status != MAQ_OK) break;
    const maquette::Frame frame(taken);
    longest_ns = std::max(longest_ns, frame.origin().horizon_ns);
  }
  EXPECT_EQ(status, MAQ_ERROR_DEVICE_LOST) << latest_text();
  EXPECT_GT(longest_ns, kPeriod_ns);
  EXPECT_LE(longest_ns, 300000000);
  maq_frame* none = nullptr;
  EXPECT_EQ(maq_concealer_acquire_frame(concealer.get(), 0, &none), MAQ_ERROR_DEVICE_LOST) << "and remains so";
}

TEST_F(Concealer, ASlowAppGetsTheNewestFrameAndDropsAreCounted) {
  maquette::Source source = open("stub:people?fps=60&size=64x48&live=1");
  maquette::Concealer concealer(context_, source, config());
  std::vector<Seen> all;
  for (int i = 0; i < 8; ++i) {
    const auto frame = concealer.next(kPatience_ns);
    ASSERT_TRUE(frame);
    all.push_back({frame->desc(), frame->origin()});
    std::this_thread::sleep_for(std::chrono::milliseconds(120));
  }
  check(all, 300);
  EXPECT_GT(concealer.stats().dropped_count, 8u);
}

TEST_F(Concealer, EndsWithItsSource) {
  maquette::Source source = open("stub:people?fps=60&size=64x48&live=1&frames=20");
  maquette::Concealer concealer(context_, source, config(50));
  maq_status status = MAQ_OK;
  while (status == MAQ_OK) {
    maq_frame* taken = nullptr;
    status = maq_concealer_acquire_frame(concealer.get(), kPatience_ns, &taken);
    maq_frame_release(taken);
  }
  EXPECT_EQ(status, MAQ_END_OF_STREAM);
}

TEST_F(Concealer, StoppingTheSourceEndsAWaitOfAnotherThread) {
  maquette::Source source = open("stub:people?fps=30&size=64x48&stall=60s@10");
  maquette::Concealer concealer(context_, source, config(100));
  std::atomic<int> frames{0};
  std::thread waiting([&] {
    while (concealer.next(MAQ_WAIT_FOREVER)) ++frames;
  });
  while (frames < 8) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  source.stop();
  waiting.join();
}

TEST_F(Concealer, ClosesWhileTheSourceStallsOrHangsAndLeavesItUsable) {
  for (const char* faults : {"", "&stall=60s@8", "&hang=60s@8"}) {
    for (const bool source_first : {false, true}) {
      auto source =
          std::make_unique<maquette::Source>(open(std::string("stub:people?fps=60&size=64x48&live=1") + faults));
      auto concealer = std::make_unique<maquette::Concealer>(context_, *source, config());
      take(*concealer, 3);
      if (source_first) source.reset();
      concealer.reset();
      if (!source_first && faults[0] == '\0') {
        EXPECT_TRUE(source->next(kPatience_ns)) << "its frames come from it again";
      }
    }
  }
}

TEST_F(Concealer, AConcealedSourceIsBusy) {
  maquette::Source source = open("stub:people?fps=30&size=64x48&live=1");
  {
    maquette::Concealer concealer(context_, source, config());
    maq_frame* frame = nullptr;
    EXPECT_EQ(maq_source_acquire_frame(source.get(), 0, &frame), MAQ_ERROR_BUSY);
    EXPECT_NE(latest_text().find("concealer"), std::string::npos);
    maq_concealer* second = nullptr;
    EXPECT_EQ(maq_concealer_create(context_.get(), source.get(), nullptr, &second), MAQ_ERROR_BUSY);
  }
  EXPECT_TRUE(source.next(kPatience_ns));
  maquette::Concealer again(context_, source, config());
  EXPECT_TRUE(again.next(kPatience_ns));
}

TEST_F(Concealer, ItsSourceIsDestroyedAfterTheStateCallbackThatRuns) {
  struct Listener {
    std::promise<void> begun, concealed;
    std::atomic<bool> is_done{false};
  } listener;
  maq_source_config config = maquette::default_source_config();
  config.state_user_data = &listener;
  config.state_callback = [](void* user_data, maq_source_state state, const char*) {
    if (state != MAQ_SOURCE_STARTED) return;
    Listener& self = *static_cast<Listener*>(user_data);
    self.begun.set_value();
    self.concealed.get_future().wait();
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    self.is_done = true;
  };
  std::optional<maquette::Source> source(std::in_place, context_, "stub:people?size=64x48&live=1", &config);
  listener.begun.get_future().wait();
  const maquette::Concealer concealer(context_, *source, this->config());
  listener.concealed.set_value();
  source.reset();
  EXPECT_TRUE(listener.is_done) << "what it uses may be freed now";
}

TEST_F(Concealer, WhatIsWrongIsTold) {
  maquette::Source file = open("stub:people?size=64x48&frames=5");
  maq_concealer* made = nullptr;
  EXPECT_EQ(maq_concealer_create(context_.get(), file.get(), nullptr, &made), MAQ_ERROR_UNSUPPORTED);
  EXPECT_NE(latest_text().find("live=1"), std::string::npos);
  EXPECT_TRUE(file.next()) << "it is as it was";
  maquette::Source source = open("stub:people?size=64x48&live=1");
  const auto refused = [&](const char* name, auto&& change) {
    maq_concealer_config wrong = config();
    change(wrong);
    EXPECT_EQ(maq_concealer_create(context_.get(), source.get(), &wrong, &made), MAQ_ERROR_INVALID_ARGUMENT) << name;
    EXPECT_NE(latest_text().find(std::string("config.") + name), std::string::npos) << latest_text();
  };
  refused("max_gap_ms", [](maq_concealer_config& wrong) { wrong.max_gap_ms = 10001; });
  refused("threads", [](maq_concealer_config& wrong) { wrong.threads = 65; });
  refused("struct_size", [](maq_concealer_config& wrong) { wrong.struct_size = 1; });
  EXPECT_EQ(maq_concealer_create(context_.get(), nullptr, nullptr, &made), MAQ_ERROR_INVALID_ARGUMENT);
  maq_concealer_stats stats{};
  maquette::Concealer concealer(context_, source, config());
  EXPECT_EQ(maq_concealer_get_stats(concealer.get(), &stats), MAQ_ERROR_INVALID_ARGUMENT) << "without struct_size";
}

}  // namespace
