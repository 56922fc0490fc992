// Files and stubs replayed as cameras, and the faults that a URI asks for.
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cstring>
#include <mutex>
#include <set>
#include <thread>

#include "sources/recording/recording.h"
#include "sources/registry.h"
#include "sources/synthetic/fault_injection.h"
#include "support/expect_error.h"
#include "support/source_threads.h"
#include "support/temp_folder.h"
#include "support/wait_until.h"

namespace {

using maq::NextFrame;
using Clock = std::chrono::steady_clock;
using namespace std::chrono_literals;

class FaultInjection : public ::testing::Test {
 protected:
  std::unique_ptr<maq::Source> open(const std::string& uri, int queue_length = 1, int stall_ms = 60000) {
    maq::SourceSettings settings;
    settings.queue_length = queue_length;
    settings.stall_ms = stall_ms;
    settings.reconnect_ms = 60000;
    settings.user_data = this;
    settings.on_state = [](void* self, maq_source_state state, const char*) {
      auto* test = static_cast<FaultInjection*>(self);
      std::lock_guard<std::mutex> lock(test->mutex_);
      test->states_.push_back(state);
      if (state == MAQ_SOURCE_LOST) test->lost_ns_ = Clock::now().time_since_epoch().count();
    };
    return maq::open_source(uri, settings);
  }
  // The numbers of the frames that come, until the end.
  static std::vector<uint64_t> numbers(maq::Source& source, size_t most = SIZE_MAX) {
    std::vector<uint64_t> all;
    maq::Frame frame;
    while (all.size() < most && source.next(kLimit, frame) == NextFrame::kFrame) all.push_back(frame.sequence);
    return all;
  }
  std::vector<maq_source_state> states() {
    std::lock_guard<std::mutex> lock(mutex_);
    return states_;
  }

  std::mutex mutex_;
  std::vector<maq_source_state> states_;
  std::atomic<int64_t> lost_ns_{0};
};

TEST_F(FaultInjection, AStubAsACameraComesAtItsTimesAndEnds) {
  const auto source = open("stub:pattern?live=1&frames=20&fps=100&size=32x24", 20);
  EXPECT_TRUE(source->info().is_live);
  EXPECT_EQ(source->info().clock, MAQ_CLOCK_MONOTONIC);
  std::vector<int64_t> times;
  maq::Frame frame;
  while (source->next(kLimit, frame) == NextFrame::kFrame) {
    times.push_back(frame.timestamp_ns);
    EXPECT_LE(frame.timestamp_ns, Clock::now().time_since_epoch().count()) << "not before its time";
    frame.clear();
  }
  ASSERT_GE(times.size(), 2u) << "a busy machine may lose some";
  EXPECT_EQ((times.back() - times.front()) % 10000000, 0) << "times are those of the stub, whenever it gets to run";
  EXPECT_EQ(source->next(0, frame), NextFrame::kEnd);
}

TEST_F(FaultInjection, TheNewestFrameIsKeptWhenNoneAreTaken) {
  const auto source = open("stub:pattern?live=1&fps=100&size=32x24");
  ASSERT_TRUE(wait_until([&] { return source->drops() > 5; }));
  maq::Frame frame;
  ASSERT_EQ(source->next(kLimit, frame), NextFrame::kFrame);
  EXPECT_GT(frame.sequence, 5u);
  EXPECT_GE(source->drops(), frame.sequence - 1);
}

TEST_F(FaultInjection, SpeedAndLoopAreHeeded) {
  const auto source = open("stub:pattern?live=1&frames=3&fps=5&speed=20&loop=1&size=32x24", 10);
  EXPECT_NEAR(source->info().fps, 100, 1e-9);
  maq::Frame frame;
  int64_t first_ns = 0;
  uint64_t last = 0;
  for (int i = 0; i < 9; ++i) {
    frame.clear();
    ASSERT_EQ(source->next(kLimit, frame), NextFrame::kFrame);
    if (i == 0) first_ns = frame.timestamp_ns - int64_t(frame.sequence) * 10000000;
    EXPECT_NEAR(double(frame.timestamp_ns - first_ns), double(frame.sequence) * 1e7, 1e3) << "10 ms each, laps too";
    EXPECT_TRUE(i == 0 || frame.sequence > last);
    last = frame.sequence;
  }
}

TEST_F(FaultInjection, AReplayCanSeekAlsoFromItsEnd) {
  const auto source = open("stub:pattern?live=1&frames=20&fps=100&size=32x24", 5);
  maq::Frame frame;
  ASSERT_EQ(source->next(kLimit, frame), NextFrame::kFrame);
  int64_t last_ns = frame.timestamp_ns;
  for (const uint64_t number : {15u, 3u, 18u}) {
    source->seek(int64_t(number) * 10000000);
    ASSERT_EQ(source->next(kLimit, frame), NextFrame::kFrame);
    const auto shown = open("stub:pattern?size=32x24");
    shown->seek(int64_t(number) * 10000000);
    maq::Frame expected;
    ASSERT_EQ(shown->next(0, expected), NextFrame::kFrame);
    EXPECT_EQ(std::memcmp(frame.image.planes[0].data, expected.storage.data(), expected.storage.size()), 0) << number;
    EXPECT_GT(frame.timestamp_ns, last_ns) << "the clock goes on";
    last_ns = frame.timestamp_ns;
    while (source->next(kLimit, frame) == NextFrame::kFrame) last_ns = frame.timestamp_ns;
  }
  const auto image = open("stub:people?drop=0.1");
  EXPECT_NO_THROW(image->seek(0));
}

TEST_F(FaultInjection, DroppedFramesAreCountedAndTheSameForASeed) {
  const std::string uri = "stub:pattern?frames=40&fps=200&size=32x24&drop=0.5&fault_seed=";
  const auto first = open(uri + "3", 40), again = open(uri + "3", 40), other = open(uri + "4", 40);
  const auto taken = numbers(*first);
  ASSERT_GT(taken.size(), 0u);
  EXPECT_LT(taken.size(), 35u);
  if (first->drops() + taken.size() == 40 && again->drops() + numbers(*again).size() == 40) {
    EXPECT_NE(taken, numbers(*other));
  }
  EXPECT_GE(first->drops(), taken.back() + 1 - taken.size()) << "those after the last that came are not known";
}

TEST_F(FaultInjection, CorruptFramesHaveNoiseAndTheirMemoryIsTheirOwn) {
  const auto clean = open("stub:pattern?frames=1&size=64x48"),
             source = open("stub:pattern?live=1&fps=100&size=64x48&corrupt=1");
  maq::Frame good;
  ASSERT_EQ(clean->next(0, good), NextFrame::kFrame);
  std::vector<maq::Frame> held(4);
  for (maq::Frame& frame : held) {
    ASSERT_EQ(source->next(kLimit, frame), NextFrame::kFrame);
    int different = 0;
    for (int i = 0; i < 64 * 48 * 3; ++i) different += frame.image.planes[0].data[i] != good.storage[size_t(i)];
    EXPECT_GT(different, 64 * 48 / 2) << "a quarter of the bytes";
  }
  std::set<const uint8_t*> places;
  for (const maq::Frame& frame : held) places.insert(frame.image.planes[0].data);
  EXPECT_EQ(places.size(), held.size());
}

TEST_F(FaultInjection, StallsAreReportedAndEnd) {
  const auto source = open("stub:pattern?fps=100&size=32x24&stall=400ms@5", 10, 100);
  maq::Frame frame;
  int64_t longest_ns = 0, last_ns = 0;
  for (int i = 0; i < 1000 && longest_ns < 390000000; ++i) {
    frame.clear();
    ASSERT_EQ(source->next(kLimit, frame), NextFrame::kFrame);
    if (i > 0) longest_ns = std::max(longest_ns, frame.timestamp_ns - last_ns);
    last_ns = frame.timestamp_ns;
  }
  EXPECT_GE(longest_ns, 390000000) << "no frame comes for 400 ms";
  ASSERT_TRUE(wait_until([&] { return states().size() >= 3; }));
  auto seen = states();
  seen.resize(3);  // on a busy machine it may stall again by now
  EXPECT_EQ(seen, (std::vector<maq_source_state>{MAQ_SOURCE_STARTED, MAQ_SOURCE_STALLED, MAQ_SOURCE_RECONNECTED}));
}

TEST_F(FaultInjection, AnUnpluggedOneComesBack) {
  const auto source = open("stub:pattern?fps=100&size=32x24&unplug=300ms@100ms", 10);
  const auto begin = Clock::now();
  maq::Frame frame;
  uint64_t last = 0;
  for (bool came_back = false; !came_back;) {
    frame.clear();
    ASSERT_EQ(source->next(kLimit, frame), NextFrame::kFrame);
    const auto seen = states();
    came_back = !seen.empty() && seen.back() == MAQ_SOURCE_RECONNECTED;
    EXPECT_TRUE(last == 0 || frame.sequence > last);
    last = frame.sequence;
  }
  EXPECT_GE(Clock::now() - begin, 400ms);
  EXPECT_GT(frame.timestamp_ns, lost_ns_ + 290000000) << "what came meanwhile is lost";
  EXPECT_EQ(states(), (std::vector<maq_source_state>{MAQ_SOURCE_STARTED, MAQ_SOURCE_LOST, MAQ_SOURCE_RECONNECTING,
                                                     MAQ_SOURCE_RECONNECTED}));
}

TEST_F(FaultInjection, AnUnpluggedOneThatStaysAwayIsLost) {
  maq::SourceSettings settings;
  settings.reconnect_ms = 200;
  const auto source = maq::open_source("stub:pattern?unplug@3&fps=100&size=32x24", settings);
  expect_error(MAQ_ERROR_DEVICE_LOST, "was lost and did not come back within 200 ms", [&] { numbers(*source); });
}

TEST_F(FaultInjection, ClosingDoesNotWaitForOneThatHangs) {
  auto source = open("stub:pattern?fps=100&size=32x24&hang=6s@0");
  source.reset();
  EXPECT_TRUE(SourceThreads::any()) << "the thread still hangs";
}

TEST_F(FaultInjection, ClosingWaitsForAStateCallbackThatRuns) {
  struct Callback {
    std::atomic<bool> begun{false}, ended{false};
  } callback;
  maq::SourceSettings settings;
  settings.user_data = &callback;
  settings.on_state = [](void* self, maq_source_state, const char*) {
    auto* state = static_cast<Callback*>(self);
    state->begun = true;
    std::this_thread::sleep_for(300ms);  // longer than closing waits for a device
    state->ended = true;
  };
  auto source = maq::open_source("stub:pattern?live=1&fps=100&size=32x24", settings);
  ASSERT_TRUE(wait_until([&] { return callback.begun.load(); }));
  source.reset();
  EXPECT_TRUE(callback.ended) << "the app may free what its callback uses";
}

TEST_F(FaultInjection, LateFramesKeepTheirTimes) {
  const auto source = open("stub:pattern?frames=20&fps=100&size=32x24&jitter=30ms", 20);
  maq::Frame frame;
  double latest_ms = 0;
  while (source->next(kLimit, frame) == NextFrame::kFrame) {
    latest_ms = std::max(latest_ms, double(Clock::now().time_since_epoch().count() - frame.timestamp_ns) / 1e6);
    frame.clear();
  }
  EXPECT_GT(latest_ms, 10);
}

TEST_F(FaultInjection, ADamagedFrameOfARecordingIsLeftOut) {
  const TempFolder folder;
  const std::string path = folder.file("a.maqrec");
  maq::RecordingWriter writer(path, {}, 0);
  maq::Frame frame;
  frame.allocate_bgr(32, 24);
  uint64_t middle = 0;
  for (int i = 0; i < 6; ++i) {
    if (i == 3) middle = writer.size_bytes();
    frame.timestamp_ns = i * 10000000;
    frame.sequence = uint64_t(i);
    writer.add(frame);
  }
  writer.finish();
  std::string bytes = read_text(path);
  bytes[middle + 500] ^= 1;
  write_text(path, bytes);
  const auto source = open("rec:" + path + "?live=1", 10);
  EXPECT_EQ(numbers(*source), (std::vector<uint64_t>{0, 1, 2, 4, 5}));
  EXPECT_EQ(source->drops(), 1u);
}

TEST_F(FaultInjection, WrongOptionsAreSentences) {
  for (const char* option : {"stall=2s", "stall=2@3s", "stall=2s@", "unplug=2s", "unplug@", "unplug@x", "hang@5s",
                             "hang=1e9s@1", "unplug=-2s@3s"}) {
    expect_error(MAQ_ERROR_INVALID_ARGUMENT, "is not understood",
                 [&] { maq::open_source(std::string("stub:pattern?") + option); });
  }
  expect_error(MAQ_ERROR_INVALID_ARGUMENT, "jitter=20 ", [] { maq::open_source("stub:pattern?jitter=20"); });
  expect_error(MAQ_ERROR_INVALID_ARGUMENT, "drop=2 ", [] { maq::open_source("stub:pattern?drop=2"); });
  expect_error(MAQ_ERROR_INVALID_ARGUMENT, "does not go with", [] { maq::open_source("stub:pattern?live=0&drop=.1"); });
  expect_error(MAQ_ERROR_INVALID_ARGUMENT, "Option speed", [] { maq::open_source("stub:pattern?speed=2"); });
  expect_error(MAQ_ERROR_NOT_FOUND, "/dev/video77", [] { maq::open_source("v4l2:/dev/video77?drop=0.1"); });
}

}  // namespace
