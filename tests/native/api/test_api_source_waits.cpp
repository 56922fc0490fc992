#include <gtest/gtest.h>
#include <poll.h>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <future>
#include <maquette/maquette.hpp>
#include <string>

#include "support/source_threads.h"

namespace {

// A camera that never delivers a frame.
constexpr char kStalled[] = "stub:pattern?size=16x16&live=1&stall=@0";

class ApiSourceWaits : public ::testing::Test {
 protected:
  maq_source* open(const char* uri) {
    maq_source* source = nullptr;
    EXPECT_EQ(maq_source_create(context_.get(), uri, nullptr, &source), MAQ_OK) << maq_last_error(nullptr);
    return source;
  }

  // Another thread's call for a frame. Nothing can be seen of it once it waits, so that it gets some time to.
  static std::future<maq_status> begin_to_wait(maq_source* source, int64_t timeout_ns) {
    std::promise<void> begun;
    std::future<void> has_begun = begun.get_future();
    auto waiter = std::async(std::launch::async, [source, timeout_ns, begun = std::move(begun)]() mutable {
      begun.set_value();
      maq_frame* frame = nullptr;
      const maq_status status = maq_source_acquire_frame(source, timeout_ns, &frame);
      EXPECT_EQ(frame, nullptr);
      return status;
    });
    has_begun.wait();
    EXPECT_EQ(waiter.wait_for(std::chrono::milliseconds(50)), std::future_status::timeout);
    return waiter;
  }

  maquette::Context context_;
};

TEST_F(ApiSourceWaits, StopWakesTheThreadThatWaitsForAFrame) {
  maq_source* source = open(kStalled);
  for (const int64_t timeout_ns : {int64_t(MAQ_WAIT_FOREVER), INT64_MAX}) {
    if (timeout_ns == INT64_MAX) source = open(kStalled);
    std::future<maq_status> waiter = begin_to_wait(source, timeout_ns);
    EXPECT_EQ(maq_source_stop(source), MAQ_OK);
    EXPECT_EQ(waiter.get(), MAQ_CANCELLED);
    EXPECT_STREQ(maq_last_error(source), "The source was stopped.");
    maq_source_destroy(source);
  }
}

TEST_F(ApiSourceWaits, DestroyEndsTheWaitOfAnotherThreadFirst) {
  for (int i = 0; i < 10; ++i) {
    maq_source* source = open(kStalled);
    std::future<maq_status> waiter = begin_to_wait(source, MAQ_WAIT_FOREVER);
    maq_source_destroy(source);
    EXPECT_EQ(waiter.get(), MAQ_CANCELLED);
  }
}

TEST_F(ApiSourceWaits, AStoppedSourceGivesNoMoreFrames) {
  for (const char* uri : {"stub:pattern?size=16x16", "stub:pattern?size=16x16&live=1&fps=500",
                          "image:" MAQ_TEST_MEDIA "/photo.jpg", "video:" MAQ_TEST_MEDIA "/clip.mp4"}) {
    maquette::Source source(context_, uri);
    if (std::string(uri).rfind("image:", 0) != 0) {
      const auto held = source.next();
      source.stop();
      EXPECT_GT(held->desc().width_px, 0) << "a frame that is held stays";
    } else {
      source.stop();
    }
    EXPECT_FALSE(source.next().has_value()) << uri;
    maq_frame* frame = nullptr;
    EXPECT_EQ(maq_source_acquire_frame(source.get(), 0, &frame), MAQ_CANCELLED) << uri;
    source.stop();
    EXPECT_EQ(source.info().frame_pool_size, 4u);
    maq_source_control_info info{};
    info.struct_size = sizeof info;
    const maq_status status = maq_source_get_control(source.get(), MAQ_SOURCE_CONTROL_GAIN, &info);
    EXPECT_EQ(status, source.info().is_live == 1 ? MAQ_CANCELLED : MAQ_ERROR_UNSUPPORTED) << uri;
  }
}

TEST_F(ApiSourceWaits, AStateCallbackMayStopItsSource) {
  struct Stopper {
    std::promise<maq_source*> made;
    std::shared_future<maq_source*> source = made.get_future().share();
    std::atomic<int> calls{0};
  } stopper;
  maq_source_config config = maquette::default_source_config();
  config.state_user_data = &stopper;
  config.state_callback = [](void* user_data, maq_source_state, const char*) {
    Stopper& self = *static_cast<Stopper*>(user_data);
    ++self.calls;
    EXPECT_EQ(maq_source_stop(self.source.get()), MAQ_OK);
  };
  {
    maquette::Source source(context_, std::string(kStalled) + "&unplug=@1", &config);
    stopper.made.set_value(source.get());
    EXPECT_FALSE(source.next().has_value());
  }
  EXPECT_EQ(stopper.calls, 1) << "none begins after the stop";
}

bool is_readable(int fd, int timeout_ms) {
  pollfd polled{fd, POLLIN, 0};
  return ::poll(&polled, 1, timeout_ms) == 1;
}

TEST_F(ApiSourceWaits, AnEventTellsOfFramesAndOfTheEnd) {
  constexpr int kLimitMs = 60000;
  maquette::Source once(context_, "stub:pattern?size=16x16&live=1&stall=@1");
  const int fd = *once.event_fd();
  EXPECT_EQ(once.event_fd(), fd) << "one for the source";
  for (int i = 0; i < 2; ++i) ASSERT_TRUE(is_readable(fd, kLimitMs)) << "until the frame is taken";
  EXPECT_TRUE(once.next(0).has_value());
  EXPECT_FALSE(is_readable(fd, 20));

  maquette::Source ending(context_, "stub:pattern?size=16x16&live=1&fps=20&frames=3");
  maq_status status = MAQ_OK;
  while (status == MAQ_OK) {
    ASSERT_TRUE(is_readable(*ending.event_fd(), kLimitMs));
    maq_frame* frame = nullptr;
    status = maq_source_acquire_frame(ending.get(), 0, &frame);
    maq_frame_release(frame);
  }
  EXPECT_EQ(status, MAQ_END_OF_STREAM);
  EXPECT_TRUE(is_readable(*ending.event_fd(), 0)) << "at the end no call waits";
  ending.seek(0);
  EXPECT_TRUE(is_readable(*ending.event_fd(), kLimitMs));
  EXPECT_TRUE(ending.next().has_value());
}

TEST_F(ApiSourceWaits, AnEventTellsOfAStopAndOfALoss) {
  maquette::Source stopped(context_, kStalled);
  const int fd = *stopped.event_fd();
  EXPECT_FALSE(is_readable(fd, 20));
  stopped.stop();
  EXPECT_TRUE(is_readable(fd, 0));
  EXPECT_FALSE(stopped.next().has_value());
  EXPECT_TRUE(is_readable(fd, 0));

  maq_source_config config = maquette::default_source_config();
  config.reconnect_ms = MAQ_NO_RECONNECT;
  maquette::Source lost(context_, "stub:pattern?size=16x16&live=1&unplug=@0", &config);
  EXPECT_TRUE(is_readable(*lost.event_fd(), 60000));
  maq_frame* frame = nullptr;
  EXPECT_EQ(maq_source_acquire_frame(lost.get(), 0, &frame), MAQ_ERROR_DEVICE_LOST);

  EXPECT_FALSE(maquette::Source(context_, "stub:pattern?size=16x16").event_fd().has_value());
}

TEST_F(ApiSourceWaits, ATimeoutOfThreeCenturiesIsNotOver) {
  maquette::Source source(context_, "stub:pattern?size=16x16&live=1&fps=4");
  for (const int64_t timeout_ns : {INT64_MAX, INT64_MAX - 1, INT64_MAX / 2}) {
    EXPECT_TRUE(source.next(timeout_ns).has_value());
  }
}

}  // namespace
