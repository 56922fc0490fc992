// Cameras of Android that lose frames, are taken away and closed while Android calls back, on an Android in memory.
#include "support/android_camera_test.h"

#include <atomic>
#include <chrono>
#include <thread>

#include "core/files/event_fd.h"
#include "sources/android/camera2_errors.h"
#include "support/source_threads.h"

namespace {

using AndroidCameraLosses = AndroidCameraTest;

TEST_F(AndroidCameraLosses, FramesThatTheDeviceLosesLeaveGaps) {
  const auto live = source(8);
  ASSERT_TRUE(fake_.deliver(1));
  EXPECT_EQ(next(*live).sequence, 0u);
  fake_.fail_capture();
  fake_.lose_buffer();
  fake_.fail_capture(true);  // its image comes
  ASSERT_TRUE(fake_.deliver(2));
  EXPECT_EQ(next(*live).sequence, 3u);
  EXPECT_EQ(live->drops(), 2u);
}

TEST_F(AndroidCameraLosses, LateCallbacksDoNothing) {
  auto opened = camera();
  fake_.announce();
  EXPECT_EQ(wait(*opened).event, Event::kTimeout) << "no image";
  opened->close();
  fake_.announce();
  EXPECT_EQ(wait(*opened).event, Event::kLost);
  fake_.lose();
  opened.reset();
  fake_.announce();
  fake_.fail_capture();
  fake_.lose_buffer();
  fake_.lose();
  fake_.lose(ndk::ERROR_CAMERA_DEVICE);
  // Nor do they reach the next camera.
  opened = camera();
  EXPECT_EQ(wait(*opened, 20).event, Event::kTimeout);
  EXPECT_EQ(frame(*opened, 1).buffer.sequence, 1u);
}

TEST_F(AndroidCameraLosses, WaitingEndsByImageWakeTimeoutAndLoss) {
  const auto opened = camera();
  maq::CameraBuffer buffer;
  std::string reason;
  maq::EventFd wake;
  EXPECT_EQ(opened->wait(wake.get(), 10, buffer, reason), Event::kTimeout);
  std::thread android([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    fake_.deliver(1);
  });
  EXPECT_EQ(opened->wait(wake.get(), 60000, buffer, reason), Event::kFrame);
  android.join();
  std::thread app([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    wake.signal();
  });
  EXPECT_EQ(opened->wait(wake.get(), 60000, buffer, reason), Event::kWoken);
  app.join();
  wake.take();
  fake_.deliver(2);
  fake_.lose();
  EXPECT_EQ(opened->wait(wake.get(), 60000, buffer, reason), Event::kLost) << "the loss goes before images";
  EXPECT_EQ(reason, maq::kCamera2Disconnected);
}

TEST_F(AndroidCameraLosses, EachErrorOfALostCameraIsAReason) {
  const std::pair<int, const char*> table[] = {{0, "took the camera away"},
                                               {ndk::ERROR_CAMERA_IN_USE, "another app"},
                                               {ndk::ERROR_MAX_CAMERAS_IN_USE, "at once"},
                                               {ndk::ERROR_CAMERA_DISABLED, "switched off"},
                                               {ndk::ERROR_CAMERA_DEVICE, "device failed"},
                                               {ndk::ERROR_CAMERA_SERVICE, "service failed"},
                                               {1234, "device failed"}};
  for (const auto& [error, text] : table) {
    const auto opened = camera();
    fake_.lose(error);
    fake_.lose(ndk::ERROR_CAMERA_SERVICE);  // a consequence
    const Answer answer = wait(*opened);
    EXPECT_EQ(answer.event, Event::kLost);
    EXPECT_NE(answer.reason.find(text), std::string::npos) << answer.reason;
  }
}

TEST_F(AndroidCameraLosses, ACameraThatIsTakenAwayComesBack) {
  auto live = source();
  ASSERT_TRUE(fake_.deliver(1));
  const maq::Frame held = next(*live);
  fake_.break_call("ACameraManager_openCamera", ndk::ACAMERA_ERROR_CAMERA_IN_USE, 0, 2);
  fake_.lose();
  ASSERT_TRUE(reports_.wait_for(MAQ_SOURCE_RECONNECTED));
  EXPECT_EQ(fake_.opened(), 2);
  expect_pixels(held.image, 320, 240, 1, "a frame from before");
  ASSERT_TRUE(fake_.deliver(2));
  const maq::Frame after = next(*live);
  expect_pixels(after.image, 320, 240, 2, "a frame from after");
  EXPECT_GT(after.sequence, held.sequence);
  EXPECT_EQ(reports_.states(), (std::vector<maq_source_state>{MAQ_SOURCE_STARTED, MAQ_SOURCE_LOST,
                                                              MAQ_SOURCE_RECONNECTING, MAQ_SOURCE_RECONNECTED}));
}

TEST_F(AndroidCameraLosses, CloseWhileAndroidCallsBack) {
  std::atomic<bool> is_over{false};
  std::thread images([&] {
    while (!is_over) {
      if (!fake_.deliver(1)) std::this_thread::yield();
    }
  });
  std::thread losses([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    while (!is_over) {
      if (fake_.streaming()) fake_.lose(ndk::ERROR_CAMERA_DEVICE);
      std::this_thread::sleep_for(std::chrono::milliseconds(3));
    }
  });
  for (int i = 0; i < 100; ++i) {
    auto opened = camera();
    Answer answer{};
    do {
      answer = wait(*opened, 2);
      if (answer.event == Event::kFrame) opened->give_back(answer.buffer.slot);
    } while (answer.event == Event::kFrame && i % 2 == 0);
    if (i % 3 == 0) opened->close();
    opened.reset();
    ASSERT_EQ(fake_.misuse(), "");
  }
  is_over = true;
  images.join();
  losses.join();
}

TEST_F(AndroidCameraLosses, CloseFromAnotherThreadEndsAWait) {
  const auto opened = camera();
  std::atomic<bool> is_closed{false};
  std::thread closing([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
    opened->close();
    is_closed = true;
  });
  Answer answer{};
  do {
    fake_.deliver(1);
    answer = wait(*opened, 1);
    if (answer.event == Event::kFrame) opened->give_back(answer.buffer.slot);
  } while (!is_closed);
  closing.join();
  EXPECT_NE(wait(*opened, 1).event, Event::kFrame);
  expect_nothing_left();
}

TEST_F(AndroidCameraLosses, AThousandTimesOpenedNothingIsLeft) {
  for (int i = 0; i < 1000; ++i) {
    auto opened = camera({"", 32, 24, 0});
    const Answer answer = frame(*opened, uint8_t(i));
    if (i % 2 == 0) opened->give_back(answer.buffer.slot);
    fake_.deliver(1);  // is never taken
    opened.reset();
    ASSERT_EQ(fake_.alive(), 0u) << i;
  }
  EXPECT_EQ(fake_.opened(), 1000);
}

}  // namespace
