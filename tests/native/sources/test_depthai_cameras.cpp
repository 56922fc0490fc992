// DepthAI cameras, and the live source above them, on a device in memory.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <functional>
#include <limits>
#include <thread>
#include <tuple>

#include "sources/depthai/depthai_camera.h"
#include "sources/live_source.h"
#include "support/expect_error.h"
#include "support/fakes/fake_depthai.h"
#include "support/state_reports.h"
#include "support/wait_until.h"

namespace {

using namespace std::chrono_literals;
using maq::Camera;
using maq::NextFrame;
using Call = FakeDepthAi::Call;
using Fault = FakeDepthAi::Fault;

constexpr int64_t kMillisecond = 1000000;
constexpr int64_t kPeriod = 1000 * kMillisecond / 30;
constexpr int kLimitMs = 60000;  // for a defect, not for speed

// The result of a wait: pixels, depth (-1: none), number and time.
struct Picture {
  Camera::Event event = Camera::Event::kTimeout;
  int value = -1, depth_mm = -1;
  maq::CameraBuffer buffer;
};

class DepthaiCameras : public ::testing::Test {
 protected:
  std::shared_ptr<Camera> camera(const maq::DepthAiRequest& request = {64, 48, 30, {}}, int buffers = 6,
                                 const std::string& device = "") {
    return maq::depthai_opener(fake_, device, request, buffers, {})();
  }
  maq::SourceSettings settings() {
    maq::SourceSettings settings;
    settings.on_state = Reports::note;
    settings.user_data = &reports_;
    return settings;
  }
  std::unique_ptr<maq::LiveSource> source(const maq::SourceSettings& settings, const std::string& device = "") {
    return std::make_unique<maq::LiveSource>(maq::depthai_opener(fake_, device, {64, 48, 30, {}}, 6, {}), "The camera",
                                             settings);
  }

  static Picture take(Camera& camera, int timeout_ms = kLimitMs) {
    Picture picture;
    std::string reason;
    picture.event = camera.wait(-1, timeout_ms, picture.buffer, reason);
    if (picture.event != Camera::Event::kFrame) return picture;
    picture.value = picture.buffer.image.planes[0].data[0];
    if (picture.buffer.depth.width_px > 0) {
      const uint8_t* first = picture.buffer.depth.planes[0].data;
      picture.depth_mm = first[0] + 256 * first[1];
    }
    return picture;
  }
  // And gives it back at once.
  static Picture take_and_return(Camera& camera, int timeout_ms = kLimitMs) {
    const Picture picture = take(camera, timeout_ms);
    if (picture.event == Camera::Event::kFrame) camera.give_back(picture.buffer.slot);
    return picture;
  }

  void TearDown() override {
    wait_until([&] { return fake_.sessions() == 0; });
    EXPECT_EQ(fake_.sessions(), 0);
    EXPECT_EQ(fake_.frames_alive(), 0);
  }

  FakeDepthAi fake_;
  Reports reports_;
};

TEST_F(DepthaiCameras, TakeTheNearestThatTheDeviceCanDo) {
  auto opened = camera({0, 0, 0, {}});
  EXPECT_EQ(opened->format().width_px, 640);
  EXPECT_EQ(opened->format().height_px, 480);
  EXPECT_EQ(opened->format().fps, 30);
  EXPECT_EQ(opened->format().pixels, MAQ_PIXEL_NV12);
  EXPECT_TRUE(fake_.plan().with_depth);
  EXPECT_EQ(opened->identity(), "18443010A1");
  opened = camera({4000, 721, 100, false});
  EXPECT_EQ(opened->format().width_px, 1920);
  EXPECT_EQ(opened->format().height_px, 720) << "NV12 has colours for two lines";
  EXPECT_EQ(opened->format().fps, 60);
  EXPECT_FALSE(fake_.plan().with_depth);
  fake_.features.has_stereo = false;
  opened = camera();
  EXPECT_FALSE(fake_.plan().with_depth) << "it was not asked for";
  expect_error(MAQ_ERROR_UNSUPPORTED, "no pair of cameras to see depth with; open it with depth=0", [&] {
    camera({64, 48, 30, true});
  });
}

TEST_F(DepthaiCameras, ADeviceThatTellsNothingOfItselfIsOpenedAsWished) {
  fake_.features = {"", 0, -5, -1, false, false};
  const auto opened = camera({1, 48, 1e6, {}});
  EXPECT_EQ(opened->format().width_px, 2);
  EXPECT_EQ(opened->format().height_px, 48);
  EXPECT_EQ(opened->format().fps, 1e6);
}

TEST_F(DepthaiCameras, PicturesComeWithDepthTimeAndNumberWithoutACopy) {
  const auto opened = camera();
  const int64_t time = FakeDepthAi::now_ns();
  const maq::DepthAiFrame colour = fake_.colour(77, 5, time), depth = fake_.depth(1234, 900, time + 5 * kMillisecond);
  ASSERT_TRUE(fake_.send_depth(depth));
  ASSERT_TRUE(fake_.send_colour(colour));
  const Picture picture = take(*opened);
  ASSERT_EQ(picture.event, Camera::Event::kFrame);
  EXPECT_EQ(picture.buffer.image.format, MAQ_PIXEL_NV12);
  EXPECT_EQ(picture.buffer.image.planes[0].data, colour.data);
  EXPECT_EQ(picture.buffer.image.planes[0].stride_bytes, colour.stride_bytes);
  EXPECT_EQ(picture.buffer.image.planes[1].data, colour.data + colour.uv_offset_bytes);
  EXPECT_EQ(picture.buffer.depth.format, MAQ_PIXEL_DEPTH16);
  EXPECT_EQ(picture.buffer.depth.planes[0].data, depth.data);
  EXPECT_EQ(picture.buffer.depth.width_px, 64);
  EXPECT_EQ(picture.depth_mm, 1234);
  EXPECT_EQ(picture.buffer.timestamp_ns, time);
  EXPECT_EQ(picture.buffer.sequence, 0u);
  opened->give_back(picture.buffer.slot);
}

TEST_F(DepthaiCameras, PairsAreMadeByTime) {
  const auto opened = camera();
  const int64_t start = FakeDepthAi::now_ns() - kSecond;
  // The numbers of the two cameras have nothing to do with each other, and depth comes two images late.
  for (int i = 0; i < 12; ++i) {
    fake_.send_colour(fake_.colour(uint8_t(i), i, start + i * kPeriod));
    if (i >= 2) fake_.send_depth(fake_.depth(uint16_t(1000 + i - 2), i + 5, start + (i - 2) * kPeriod + kPeriod / 3));
    if (i < 2) continue;
    const Picture picture = take_and_return(*opened);
    EXPECT_EQ(picture.value, i - 2);
    EXPECT_EQ(picture.depth_mm, 1000 + i - 2);
  }
}

TEST_F(DepthaiCameras, OfTwoDepthImagesAsNearTheOneOfTheSameNumberIsTaken) {
  const auto opened = camera();
  const int64_t time = FakeDepthAi::now_ns();
  fake_.send_depth(fake_.depth(1, 6, time - kPeriod / 4));
  fake_.send_depth(fake_.depth(2, 7, time + kPeriod / 4));
  fake_.send_colour(fake_.colour(1, 7, time));
  EXPECT_EQ(take_and_return(*opened).depth_mm, 2);
  fake_.send_depth(fake_.depth(3, 8, time + kPeriod));
  fake_.send_depth(fake_.depth(4, 9, time + kPeriod + kPeriod / 4));
  fake_.send_colour(fake_.colour(2, 9, time + kPeriod));
  EXPECT_EQ(take_and_return(*opened).depth_mm, 3) << "the nearest, whatever its number";
}

TEST_F(DepthaiCameras, WithoutUsableTimesPairsAreMadeByNumberAndTheTimeIsThatOfArrival) {
  for (const int64_t nonsense : {int64_t(0), int64_t(-1), INT64_MIN, INT64_MAX, FakeDepthAi::now_ns() + 5 * kSecond}) {
    const auto opened = camera();
    for (int i = 0; i < 5; ++i) {
      fake_.send_colour(fake_.colour(uint8_t(i), i, nonsense));
      if (i != 3) fake_.send_depth(fake_.depth(uint16_t(100 + i), i, nonsense));
    }
    const int64_t now = FakeDepthAi::now_ns();
    for (int i = 0; i < 5; ++i) {
      const Picture picture = take_and_return(*opened);
      EXPECT_EQ(picture.value, i);
      EXPECT_EQ(picture.depth_mm, i == 3 ? -1 : 100 + i);
      EXPECT_NEAR(double(picture.buffer.timestamp_ns), double(now), double(kSecond));
    }
  }
}

TEST_F(DepthaiCameras, DepthThatIsLateIsWaitedForAndThenDoneWithout) {
  const auto opened = camera();
  fake_.send_colour(fake_.colour(1, 1));
  const auto before = std::chrono::steady_clock::now();
  const Picture picture = take_and_return(*opened);
  const auto waited = std::chrono::steady_clock::now() - before;
  EXPECT_EQ(picture.value, 1);
  EXPECT_EQ(picture.depth_mm, -1);
  EXPECT_GT(waited, 60ms);
  EXPECT_EQ(fake_.frames_alive(), 0) << "what is returned is freed";
  fake_.send_depth(fake_.depth(1, 1));
  EXPECT_EQ(take_and_return(*opened, 50).event, Camera::Event::kTimeout) << "too late: the picture is gone";
}

TEST_F(DepthaiCameras, DepthOfALaterPictureEndsTheWait) {
  const auto opened = camera({64, 48, 0.2, {}});  // at this rate an image waits for its depth for 15 seconds
  const int64_t time = FakeDepthAi::now_ns() - 6 * kSecond;
  fake_.send_colour(fake_.colour(1, 1, time));
  fake_.send_colour(fake_.colour(2, 2, time + 5 * kSecond));
  fake_.send_depth(fake_.depth(222, 2, time + 5 * kSecond));
  EXPECT_EQ(take_and_return(*opened, 10000).depth_mm, -1);
  EXPECT_EQ(take_and_return(*opened, 10000).depth_mm, 222);
}

TEST_F(DepthaiCameras, DepthOfAnotherRateGoesToThePicturesItFits) {
  for (const int every : {2, 3}) {
    const auto opened = camera();
    const int64_t start = FakeDepthAi::now_ns() - kSecond;
    for (int i = 0; i < 4; ++i) {
      fake_.send_colour(fake_.colour(uint8_t(i), i, start + i * kPeriod));
      if (i % every == 0) fake_.send_depth(fake_.depth(uint16_t(100 + i), i / every, start + i * kPeriod));
    }
    for (int i = 0; i < 4; ++i) EXPECT_EQ(take_and_return(*opened).depth_mm, i % every == 0 ? 100 + i : -1);
  }
  const auto opened = camera();
  const int64_t start = FakeDepthAi::now_ns() - kSecond;
  for (int i = 0; i < 8; ++i) {
    if (i % 2 == 0) fake_.send_colour(fake_.colour(uint8_t(i), i / 2, start + i * kPeriod / 2));
    fake_.send_depth(fake_.depth(uint16_t(100 + i), i, start + i * kPeriod / 2));
    if (i % 2 == 0) {
      EXPECT_EQ(take_and_return(*opened).depth_mm, 100 + i);
    }
  }
}

TEST_F(DepthaiCameras, DepthThatDoesNotFitThePictureIsDropped) {
  const std::pair<const char*, std::function<void(maq::DepthAiFrame&)>> broken[] = {
      {"another shape", [](maq::DepthAiFrame& depth) { depth.height_px = 24; }},
      {"larger", [](maq::DepthAiFrame& depth) { depth.width_px = 128, depth.height_px = 96; }},
      {"no width", [](maq::DepthAiFrame& depth) { depth.width_px = 0; }},
      {"negative", [](maq::DepthAiFrame& depth) { depth.width_px = -64, depth.height_px = -48; }},
      {"huge", [](maq::DepthAiFrame& depth) { depth.width_px = INT64_MAX, depth.height_px = INT64_MAX; }},
      {"no depth", [](maq::DepthAiFrame& depth) { depth.format = MAQ_PIXEL_GREY8; }},
      {"unknown", [](maq::DepthAiFrame& depth) { depth.format.reset(); }},
      {"short", [](maq::DepthAiFrame& depth) { depth.size_bytes = depth.stride_bytes * 47; }},
      {"short lines", [](maq::DepthAiFrame& depth) { depth.stride_bytes = 126; }},
      {"odd lines", [](maq::DepthAiFrame& depth) { depth.stride_bytes = 129; }},
      {"odd address", [](maq::DepthAiFrame& depth) { ++depth.data, --depth.size_bytes; }},
      {"no bytes", [](maq::DepthAiFrame& depth) { depth.data = nullptr; }}};
  const auto opened = camera();
  int number = 0;
  for (const auto& [what, harm] : broken) {
    const int64_t time = FakeDepthAi::now_ns();
    maq::DepthAiFrame depth = fake_.depth(500, ++number, time);
    harm(depth);
    fake_.send_depth(std::move(depth));
    fake_.send_colour(fake_.colour(9, number, time));
    const Picture picture = take_and_return(*opened);
    EXPECT_EQ(picture.value, 9) << what;
    EXPECT_EQ(picture.depth_mm, -1) << what;
  }
  maq::DepthAiFrame half = fake_.depth(700, ++number);
  half.width_px = 32, half.height_px = 24;
  fake_.send_colour(fake_.colour(9, number, half.timestamp_ns));
  fake_.send_depth(std::move(half));
  const Picture picture = take_and_return(*opened);
  EXPECT_EQ(picture.depth_mm, 700) << "a smaller version fits";
  EXPECT_EQ(picture.buffer.depth.width_px, 32);
}

TEST_F(DepthaiCameras, DepthThatWasNotAskedForIsNotDelivered) {
  const auto opened = camera({64, 48, 30, false});
  const int64_t time = FakeDepthAi::now_ns();
  fake_.send_depth(fake_.depth(500, 1, time));
  fake_.send_colour(fake_.colour(9, 1, time));
  EXPECT_EQ(take_and_return(*opened).depth_mm, -1);
}

TEST_F(DepthaiCameras, PicturesThatAreNotAsAgreedAreDroppedAndTheGapTells) {
  const std::pair<const char*, std::function<void(maq::DepthAiFrame&)>> broken[] = {
      {"smaller", [](maq::DepthAiFrame& colour) { colour.width_px = 32; }},
      {"no size", [](maq::DepthAiFrame& colour) { colour.width_px = colour.height_px = 0; }},
      {"unknown", [](maq::DepthAiFrame& colour) { colour.format.reset(); }},
      {"depth", [](maq::DepthAiFrame& colour) { colour.format = MAQ_PIXEL_DEPTH16; }},
      {"no bytes", [](maq::DepthAiFrame& colour) { colour.data = nullptr; }},
      {"short", [](maq::DepthAiFrame& colour) { colour.size_bytes = 100; }},
      {"colours missing", [](maq::DepthAiFrame& colour) { colour.size_bytes -= colour.stride_bytes; }},
      {"colours inside", [](maq::DepthAiFrame& colour) { colour.uv_offset_bytes = 0; }},
      {"colours outside", [](maq::DepthAiFrame& colour) { colour.uv_offset_bytes = SIZE_MAX - 5; }},
      {"short lines", [](maq::DepthAiFrame& colour) { colour.stride_bytes = 63; }},
      {"long lines", [](maq::DepthAiFrame& colour) { colour.stride_bytes = SIZE_MAX / 40; }}};
  const auto opened = camera({64, 48, 30, false});
  fake_.send_colour(fake_.colour(1, 0));
  uint32_t number = take_and_return(*opened).buffer.sequence;
  for (const auto& [what, harm] : broken) {
    maq::DepthAiFrame colour = fake_.colour(2, ++number);
    harm(colour);
    fake_.send_colour(std::move(colour));
    fake_.send_colour(fake_.colour(3, ++number));
    const Picture picture = take_and_return(*opened);
    EXPECT_EQ(picture.value, 3) << what;
    EXPECT_EQ(picture.buffer.sequence, number) << what;
  }
  maq::DepthAiFrame grey = fake_.colour(4, ++number);
  grey.format = MAQ_PIXEL_GREY8;
  fake_.send_colour(std::move(grey));
  EXPECT_EQ(take_and_return(*opened).buffer.image.format, MAQ_PIXEL_GREY8);
  maq::DepthAiFrame unpadded = fake_.colour(5, ++number);
  unpadded.size_bytes -= 32;
  fake_.send_colour(std::move(unpadded));
  EXPECT_EQ(take_and_return(*opened).value, 5) << "the padding of the last line may be missing";
}

TEST_F(DepthaiCameras, StragglersAreDroppedAndNumbersAndTimesOnlyGrow) {
  const auto opened = camera({64, 48, 30, false});
  const int64_t start = FakeDepthAi::now_ns() - kSecond;
  struct Sent {
    int64_t sequence, after_ms;
    bool is_taken;
    uint32_t number;
    int64_t time_ms;
  };
  const Sent all[] = {{100, 0, true, 0, 0},           {101, 33, true, 1, 33}, {100, 0, false, 0, 0},  // late
                      {105, 166, true, 5, 166},                                                       // four were lost
                      {106, 150, true, 6, 166},        // the clock stepped back
                      {3, 233, true, 7, 233},          // restarts its count
                      {INT64_MAX, 266, true, 8, 266},  // leaps
                      {INT64_MIN, 300, true, 9, 300}};
  for (const Sent& sent : all) {
    fake_.send_colour(fake_.colour(1, sent.sequence, start + sent.after_ms * kMillisecond));
    const Picture picture = take_and_return(*opened, 50);
    EXPECT_EQ(picture.event == Camera::Event::kFrame, sent.is_taken) << sent.sequence;
    if (!sent.is_taken) continue;
    EXPECT_EQ(picture.buffer.sequence, sent.number);
    EXPECT_EQ(picture.buffer.timestamp_ns, start + sent.time_ms * kMillisecond);
  }
}

TEST_F(DepthaiCameras, WhoHoldsEveryBufferGetsTheNewestFramesLater) {
  const auto opened = camera({64, 48, 30, false}, 3);
  std::vector<Picture> held;
  for (int i = 0; i < 3; ++i) {
    fake_.send_colour(fake_.colour(uint8_t(i), i));
    held.push_back(take(*opened));
  }
  for (int i = 3; i < 100; ++i) fake_.send_colour(fake_.colour(uint8_t(i), i));
  EXPECT_EQ(take(*opened, 30).event, Camera::Event::kTimeout);
  EXPECT_LT(fake_.frames_alive(), 20) << "old ones make room";
  for (int i = 0; i < 3; ++i) EXPECT_EQ(held[size_t(i)].value, i);
  std::thread giver([&] {
    std::this_thread::sleep_for(50ms);
    opened->give_back(held[1].buffer.slot);
  });
  const Picture next = take_and_return(*opened);
  ASSERT_EQ(next.event, Camera::Event::kFrame) << "a buffer that comes back ends the wait";
  giver.join();
  EXPECT_GT(next.value, 90);
  EXPECT_EQ(next.buffer.slot, held[1].buffer.slot);
  EXPECT_EQ(next.buffer.sequence, uint32_t(next.value)) << "the gap counts what was lost";
  EXPECT_EQ(held[2].buffer.image.planes[0].data[64 * 40], 2) << "still held, still readable";
  opened->give_back(held[0].buffer.slot);
  opened->give_back(held[2].buffer.slot);
}

TEST_F(DepthaiCameras, AWaitEndsWhenItIsWokenOrAFrameComes) {
  const auto opened = camera({64, 48, 30, false});
  int fds[2];
  ASSERT_EQ(pipe(fds), 0);
  ASSERT_EQ(write(fds[1], "x", 1), 1);
  Picture picture;
  std::string reason;
  EXPECT_EQ(opened->wait(fds[0], kLimitMs, picture.buffer, reason), Camera::Event::kWoken);
  close(fds[0]);
  close(fds[1]);
  std::thread sender([&] {
    std::this_thread::sleep_for(50ms);
    fake_.send_colour(fake_.colour(1, 1));
  });
  EXPECT_EQ(take_and_return(*opened).value, 1);
  sender.join();
}

TEST_F(DepthaiCameras, AreListedWithoutBeingOpened) {
  fake_.devices.push_back({"", "3.4", "RVC4", MAQ_ERROR_NO_PERMISSION, "X_LINK_INSUFFICIENT_PERMISSIONS"});
  const auto found = maq::list_depthai_cameras(fake_);
  ASSERT_EQ(found.size(), 2u);
  EXPECT_EQ(found[0].uri, "depthai:18443010A1");
  EXPECT_EQ(found[0].name, "DepthAI RVC2");
  EXPECT_EQ(found[0].bus, "1.2");
  EXPECT_EQ(found[0].identity, "18443010A1");
  EXPECT_EQ(found[0].status, MAQ_OK);
  EXPECT_EQ(found[1].uri, "depthai:3.4");
  EXPECT_EQ(found[1].status, MAQ_ERROR_NO_PERMISSION);
  EXPECT_NE(found[1].problem.find("udev rule"), std::string::npos) << found[1].problem;
  EXPECT_EQ(fake_.opened(), 0);
  fake_.unplug();
  EXPECT_TRUE(maq::list_depthai_cameras(fake_).empty());
  for (const Fault fault : {Fault::kRuntimeError, Fault::kError, Fault::kInt}) {
    fake_.break_call(Call::kList, fault);
    EXPECT_THROW(maq::list_depthai_cameras(fake_), maq::Error);
  }
}

TEST_F(DepthaiCameras, TheFirstThatIsFreeOrTheOneThatIsNamedIsOpened) {
  fake_.devices = {{"A", "1.1", "RVC2", MAQ_ERROR_BUSY, "X_LINK_DEVICE_ALREADY_IN_USE"},
                   {"B", "1.2", "RVC2", MAQ_OK, ""},
                   {"C", "192.168.1.5", "RVC4", MAQ_OK, ""}};
  EXPECT_EQ(camera()->identity(), "B");
  for (const char* name : {"C", "192.168.1.5"}) EXPECT_EQ(camera({64, 48, 30, {}}, 6, name)->identity(), "C");
  camera({64, 48, 30, {}}, 6, "10.0.0.9");
  EXPECT_EQ(fake_.opened_device(), "10.0.0.9") << "of another network: not listed, but it may be there";
  expect_error(MAQ_ERROR_BUSY, "DepthAI device A cannot be opened: X_LINK_DEVICE_ALREADY_IN_USE. Another program", [&] {
    camera({64, 48, 30, {}}, 6, "1.1");
  });
  expect_error(MAQ_ERROR_NOT_FOUND,
               "No DepthAI device D was found. Is the device plugged in, powered, and free? There "
               "are: A, B, C.",
               [&] {
                 camera({64, 48, 30, {}}, 6, "D");
               });
  fake_.devices.clear();
  expect_error(MAQ_ERROR_NOT_FOUND, "No DepthAI device was found.", [&] { camera(); });
}

TEST_F(DepthaiCameras, EveryCallThatFailsIsNamedAndLeavesNothingOpen) {
  const std::pair<Call, const char*> calls[] = {{Call::kList, "cannot search for devices"},
                                                {Call::kOpen, "cannot be opened"},
                                                {Call::kFeatures, "does not say what it is"},
                                                {Call::kLens, "does not give its calibration"},
                                                {Call::kStart, "does not start"}};
  for (const auto& [call, what] : calls) {
    for (const Fault fault : {Fault::kRuntimeError, Fault::kError, Fault::kInt}) {
      for (const Fault closing : {Fault::kNone, Fault::kRuntimeError, Fault::kInt}) {
        fake_.break_call(call, fault);
        fake_.break_call(Call::kClose, closing);
        try {
          camera();
          ADD_FAILURE() << what;
        } catch (const maq::Error& error) {
          EXPECT_NE(std::string(error.what()).find(what), std::string::npos) << error.what();
          EXPECT_NE(error.status(), MAQ_ERROR_INTERNAL);
          EXPECT_TRUE(fault != Fault::kError || error.status() == MAQ_ERROR_BUSY);
        }
        EXPECT_EQ(fake_.sessions(), 0) << what;
        fake_.mend();
      }
    }
  }
}

TEST_F(DepthaiCameras, WhatTheLibrarySaysBecomesAStatusAndARemedy) {
  const std::tuple<const char*, maq_status, const char*> texts[] = {
      {"Insufficient permissions to communicate with X_LINK_UNBOOTED device. Make sure udev rules are set",
       MAQ_ERROR_NO_PERMISSION, "udev rule"},
      {"No available devices (1 connected, but in use)", MAQ_ERROR_BUSY, "Another program"},
      {"Failed to find device after booting, error message: X_LINK_DEVICE_NOT_FOUND", MAQ_ERROR_NOT_FOUND,
       "plugged in"},
      {"Couldn't open stream (X_LINK_ERROR)", MAQ_ERROR_DEVICE_LOST, "cable"},
      {"Camera socket not found", MAQ_ERROR_UNSUPPORTED, "not found."}};
  for (const auto& [text, status, remedy] : texts) {
    fake_.fault_text = text;
    fake_.break_call(Call::kStart, Fault::kRuntimeError);
    expect_error(status, remedy, [&] { camera(); });
  }
}

TEST_F(DepthaiCameras, ALinkThatBreaksIsReportedAndTheSameDeviceComesBack) {
  const auto live = source(settings());
  fake_.send_colour(fake_.colour(1, 7));
  maq::Frame frame;
  ASSERT_EQ(live->next(5 * kSecond, frame), NextFrame::kFrame);
  fake_.unplug();
  ASSERT_TRUE(reports_.wait_for(MAQ_SOURCE_LOST));
  EXPECT_EQ(frame.image.planes[0].data[100], 1) << "held frames stay readable";
  fake_.devices = {{"another", "1.2", "RVC2", MAQ_OK, ""}, {"18443010A1", "5.6", "RVC2", MAQ_OK, ""}};
  fake_.plug();
  ASSERT_TRUE(reports_.wait_for(MAQ_SOURCE_RECONNECTED));
  EXPECT_EQ(fake_.opened_device(), "18443010A1");
  const int64_t time = FakeDepthAi::now_ns();
  fake_.send_colour(fake_.colour(2, 0, time));
  fake_.send_depth(fake_.depth(321, 0, time));
  maq::Frame next;
  ASSERT_EQ(live->next(5 * kSecond, next), NextFrame::kFrame);
  EXPECT_EQ(next.image.planes[0].data[0], 2);
  EXPECT_EQ(next.depth.planes[0].data[0], 321 % 256);
  EXPECT_EQ(next.sequence, 1u) << "numbers go on";
}

TEST_F(DepthaiCameras, AnotherDeviceAtTheSameAddressIsNotTaken) {
  fake_.devices.clear();
  fake_.features.id = "first";
  const maq::CameraOpener open = maq::depthai_opener(fake_, "10.0.0.9", {64, 48, 30, {}}, 6, {});
  EXPECT_EQ(open()->identity(), "first");
  fake_.features.id = "second";
  expect_error(MAQ_ERROR_DEVICE_LOST, "At 10.0.0.9 is DepthAI device second now, but it was first.", [&] { open(); });
  EXPECT_EQ(fake_.sessions(), 0);
  fake_.features.id = "first";
  EXPECT_EQ(open()->identity(), "first");
}

TEST_F(DepthaiCameras, EveryFaultOfAStreamLosesTheCameraAndBringsItBack) {
  for (const Fault fault : {Fault::kRuntimeError, Fault::kError, Fault::kInt}) {
    Reports reports;
    maq::SourceSettings asked;
    asked.on_state = Reports::note;
    asked.user_data = &reports;
    auto live = source(asked);
    fake_.break_call(Call::kProblem, fault);
    fake_.break_call(Call::kClose, fault);
    ASSERT_TRUE(reports.wait_for(MAQ_SOURCE_LOST));
    fake_.mend();
    ASSERT_TRUE(reports.wait_for(MAQ_SOURCE_RECONNECTED));
  }
}

TEST_F(DepthaiCameras, ClosingDoesNotWaitForACallThatHangs) {
  for (const Call call : {Call::kProblem, Call::kClose}) {
    auto live = source({});
    {
      std::unique_lock<std::mutex> hang(fake_.hang(call));
      // The close comes from the reset itself.
      ASSERT_TRUE(call == Call::kClose || wait_until([&] { return fake_.is_waiting(call); }));
      live.reset();  // would never return if it waited for the device
      EXPECT_EQ(fake_.sessions(), 1);
    }
    wait_until([&] { return fake_.sessions() == 0; });
    EXPECT_EQ(fake_.sessions(), 0) << "the thread closes the device when it answers";
  }
  auto live = source(settings());
  std::unique_lock<std::mutex> hang(fake_.hang(Call::kOpen));  // a device that boots
  fake_.unplug();
  ASSERT_TRUE(reports_.wait_for(MAQ_SOURCE_RECONNECTING));
  fake_.plug();
  ASSERT_TRUE(wait_until([&] { return fake_.is_waiting(Call::kOpen); }));
  live.reset();
  const int opened = fake_.opened();
  hang.unlock();
  wait_until([&] { return fake_.opened() != opened; });
  EXPECT_EQ(fake_.opened(), opened + 1) << "it was opening, and is closed when it answers";
}

TEST_F(DepthaiCameras, FramesThatComeAfterTheCloseAreDropped) {
  const auto opened = camera();
  const std::shared_ptr<maq::DepthAiReceiver> late = fake_.receiver();  // of a thread that was about to call
  fake_.send_colour(fake_.colour(1, 1));
  opened->close();
  EXPECT_EQ(fake_.frames_alive(), 0) << "what waited is forgotten";
  late->receive_colour(fake_.colour(1, 2));
  late->receive_depth(fake_.depth(1, 2));
  EXPECT_EQ(fake_.frames_alive(), 0);
  std::string reason;
  maq::CameraBuffer buffer;
  EXPECT_EQ(opened->wait(-1, 10, buffer, reason), Camera::Event::kLost);
  EXPECT_EQ(reason, "it is closed");
}

TEST_F(DepthaiCameras, CalibrationIsThatOfTheAgreedSize) {
  fake_.lens = maq::DepthAiLens{501, 502, 31, 25, {1, 2, 3, 4, 5, 6, 7, 8, 0, 0, 0, 0, 0, 0}, true};
  auto opened = camera({64, 48, 30, false});
  ASSERT_NE(opened->intrinsics(), nullptr);
  const maq_intrinsics found = *opened->intrinsics();
  EXPECT_EQ(found.width_px, 64);
  EXPECT_EQ(found.height_px, 48);
  EXPECT_EQ(found.fx_px, 501);
  EXPECT_EQ(found.fy_px, 502);
  EXPECT_EQ(found.cx_px, 31);
  EXPECT_EQ(found.cy_px, 25);
  for (int i = 0; i < 8; ++i) EXPECT_EQ(found.distortion[i], i + 1);
  opened = camera();
  ASSERT_NE(opened->intrinsics(), nullptr);
  for (const double value : opened->intrinsics()->distortion) EXPECT_EQ(value, 0) << "the device takes it out";
  fake_.lens.reset();
  EXPECT_EQ(camera()->intrinsics(), nullptr);
  fake_.lens = maq::DepthAiLens{501, 502, 31, 25, {}, true};
  EXPECT_EQ(source({})->intrinsics()->fx_px, 501);
}

TEST_F(DepthaiCameras, ALensThatCannotBeSaidIsNotSaid) {
  const maq::DepthAiPlan plain{64, 48, 30, false}, undistorted{64, 48, 30, true};
  const maq::DepthAiLens good{500, 500, 32, 24, {0.1, 0.2, 0.3, 0.4, 0.5}, true};
  ASSERT_TRUE(maq::depthai_intrinsics(good, plain));
  EXPECT_EQ(maq::depthai_intrinsics(good, plain)->distortion[4], 0.5);
  EXPECT_EQ(maq::depthai_intrinsics(good, plain)->distortion[5], 0);
  maq::DepthAiLens thin_prism = good, fisheye = good, endless = good;
  thin_prism.distortion.assign(14, 0);
  thin_prism.distortion[12] = 1e-6;
  fisheye.is_perspective = false;
  endless.distortion[1] = std::numeric_limits<double>::infinity();
  for (const maq::DepthAiLens& lens : {thin_prism, fisheye, endless}) {
    EXPECT_FALSE(maq::depthai_intrinsics(lens, plain));
    EXPECT_TRUE(maq::depthai_intrinsics(lens, undistorted));
  }
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const maq::DepthAiLens& lens :
       {maq::DepthAiLens{0, 500, 32, 24, {}, true}, maq::DepthAiLens{500, -1, 32, 24, {}, true},
        maq::DepthAiLens{500, 500, nan, 24, {}, true}, maq::DepthAiLens{nan, 500, 32, 24, {}, true}}) {
    EXPECT_FALSE(maq::depthai_intrinsics(lens, undistorted));
  }
}

TEST_F(DepthaiCameras, ControlsReachTheDeviceAndValuesOutOfRangeDoNot) {
  const auto opened = camera({64, 48, 30, false});
  maq::DepthAiFrame colour = fake_.colour(1, 1);
  colour.exposure_us = 8000, colour.gain_iso = 250, colour.focus = 140, colour.white_balance_k = 4300;
  fake_.send_colour(std::move(colour));
  take_and_return(*opened);
  EXPECT_EQ(opened->control(MAQ_SOURCE_CONTROL_EXPOSURE).value, 8000) << "what the automatic chose";
  EXPECT_EQ(opened->control(MAQ_SOURCE_CONTROL_EXPOSURE).max, 33333) << "a frame's time";
  EXPECT_EQ(opened->control(MAQ_SOURCE_CONTROL_WHITE_BALANCE).value, 4300);
  EXPECT_EQ(opened->control(MAQ_SOURCE_CONTROL_AUTO_EXPOSURE).value, 1);
  opened->set_control(MAQ_SOURCE_CONTROL_EXPOSURE, 5000.4);
  EXPECT_EQ(opened->control(MAQ_SOURCE_CONTROL_AUTO_EXPOSURE).value, 0);
  EXPECT_EQ(opened->control(MAQ_SOURCE_CONTROL_EXPOSURE).value, 5000);
  opened->set_control(MAQ_SOURCE_CONTROL_GAIN, 800);
  opened->set_control(MAQ_SOURCE_CONTROL_AUTO_EXPOSURE, 0);
  opened->set_control(MAQ_SOURCE_CONTROL_AUTO_EXPOSURE, 1);
  opened->set_control(MAQ_SOURCE_CONTROL_FOCUS, 255);
  EXPECT_EQ(opened->control(MAQ_SOURCE_CONTROL_AUTO_FOCUS).value, 0);
  opened->set_control(MAQ_SOURCE_CONTROL_AUTO_FOCUS, 1);
  opened->set_control(MAQ_SOURCE_CONTROL_WHITE_BALANCE, 6500);
  EXPECT_EQ(opened->control(MAQ_SOURCE_CONTROL_AUTO_WHITE_BALANCE).value, 0);
  opened->set_control(MAQ_SOURCE_CONTROL_AUTO_WHITE_BALANCE, 1);
  opened->set_control(MAQ_SOURCE_CONTROL_BRIGHTNESS, -10);
  const std::vector<std::string> expected = {
      "exposure 5000 250", "exposure 5000 800",  "auto_exposure 0",      "auto_exposure 1", "focus 255",
      "auto_focus 1",      "white_balance 6500", "auto_white_balance 1", "brightness -10"};
  EXPECT_EQ(fake_.commands(), expected);

  for (int which = MAQ_SOURCE_CONTROL_AUTO_EXPOSURE; which <= MAQ_SOURCE_CONTROL_BRIGHTNESS; ++which) {
    const maq_source_control_info info = opened->control(maq_source_control(which));
    EXPECT_TRUE(info.min < info.max && info.value >= info.min && info.value <= info.max &&
                info.default_value >= info.min && info.default_value <= info.max && info.step == 1)
        << which;
    for (const double value : {info.min - 1, info.max + 1, 1e300, std::numeric_limits<double>::quiet_NaN()}) {
      expect_error(MAQ_ERROR_INVALID_ARGUMENT, "goes from",
                   [&] { opened->set_control(maq_source_control(which), value); });
    }
  }
  EXPECT_EQ(fake_.commands(), expected) << "nothing of that reached the device";
  fake_.features.has_autofocus = false;
  const auto fixed = camera();
  expect_error(MAQ_ERROR_UNSUPPORTED, "cannot be focused", [&] { fixed->set_control(MAQ_SOURCE_CONTROL_FOCUS, 5); });
  expect_error(MAQ_ERROR_UNSUPPORTED, "cannot be focused", [&] { fixed->control(MAQ_SOURCE_CONTROL_AUTO_FOCUS); });
}

TEST_F(DepthaiCameras, AControlThatFailsChangesNothing) {
  const auto opened = camera();
  for (const Fault fault : {Fault::kRuntimeError, Fault::kError, Fault::kInt}) {
    fake_.break_call(Call::kControl, fault);
    for (int which = MAQ_SOURCE_CONTROL_AUTO_EXPOSURE; which <= MAQ_SOURCE_CONTROL_BRIGHTNESS; ++which) {
      const maq_source_control_info before = opened->control(maq_source_control(which));
      expect_error(fault == Fault::kError ? MAQ_ERROR_BUSY : MAQ_ERROR_DEVICE_LOST, "does not take a control",
                   [&] { opened->set_control(maq_source_control(which), before.min); });
      EXPECT_EQ(opened->control(maq_source_control(which)).value, before.value);
    }
  }
  fake_.mend();
  opened->close();
  expect_error(MAQ_ERROR_DEVICE_LOST, "is closed", [&] { opened->set_control(MAQ_SOURCE_CONTROL_BRIGHTNESS, 1); });
}

}  // namespace
