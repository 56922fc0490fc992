// Shared by the tests of Android's cameras: an Android in memory, and the expected frames.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "sources/android/camera2_camera.h"
#include "sources/live_source.h"
#include "support/fakes/fake_camera2.h"
#include "support/state_reports.h"
#include "support/wait_until.h"

namespace ndk = maq::ndk;
using Event = maq::Camera::Event;
using Layout = FakeCamera2::Layout;
using maq::NextFrame;

constexpr int kBuffers = 4;

class AndroidCameraTest : public ::testing::Test {
 protected:
  std::shared_ptr<maq::Camera> camera(const maq::CameraRequest& request = {"", 320, 240, 0},
                                      const std::string& name = "0", int display_deg = 0) {
    return maq::open_android_camera(functions_, name, request, display_deg, kBuffers);
  }
  std::unique_ptr<maq::LiveSource> source(int queue_length = 1) {
    maq::SourceSettings settings;
    settings.on_state = Reports::note;
    settings.user_data = &reports_;
    settings.queue_length = queue_length;
    return std::make_unique<maq::LiveSource>([this] { return camera(); }, "android:0", settings);
  }
  void TearDown() override {
    wait_until([&] { return fake_.alive() == 0; });
    expect_nothing_left();
  }
  void expect_nothing_left(const std::string& what = "") {
    EXPECT_EQ(fake_.alive(), 0u) << what;
    EXPECT_EQ(fake_.misuse(), "") << what;
  }

  // The immediate result of wait().
  struct Answer {
    Event event;
    maq::CameraBuffer buffer;
    std::string reason;
  };
  static Answer wait(maq::Camera& camera, int timeout_ms = 1000) {
    Answer answer{};
    answer.event = camera.wait(-1, timeout_ms, answer.buffer, answer.reason);
    return answer;
  }
  // Delivers an image, which must come as a frame.
  Answer frame(maq::Camera& camera, uint8_t seed) {
    EXPECT_TRUE(fake_.deliver(seed));
    Answer answer = wait(camera);
    EXPECT_EQ(answer.event, Event::kFrame) << answer.reason;
    return answer;
  }
  maq::Frame next(maq::LiveSource& live) {
    maq::Frame frame;
    EXPECT_EQ(live.next(kLimit, frame), NextFrame::kFrame);
    return frame;
  }

  FakeCamera2 fake_;
  const ndk::Functions functions_ = FakeCamera2::functions();
  Reports reports_;
};

// In video range, of what the fake wrote in full range.
inline int video_luma(int x, int y, uint8_t seed) {
  return int(std::lround(16 + FakeCamera2::luma(x, y, seed) * 219.0 / 255));
}
inline int video_chroma(bool is_v, int x, int y, uint8_t seed) {
  return int(std::lround(16 + FakeCamera2::chroma(is_v, x, y, seed) * 224.0 / 255));
}

inline void expect_pixels(const maq::ImageView& image, int width, int height, uint8_t seed, const std::string& what) {
  ASSERT_EQ(image.format, MAQ_PIXEL_NV12) << what;
  ASSERT_EQ(image.width_px, width) << what;
  ASSERT_EQ(image.height_px, height) << what;
  int wrong = 0;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      wrong += image.planes[0].data[size_t(y) * image.planes[0].stride_bytes + size_t(x)] != video_luma(x, y, seed);
    }
  }
  for (int y = 0; y < (height + 1) / 2; ++y) {
    const uint8_t* row = image.planes[1].data + size_t(y) * image.planes[1].stride_bytes;
    for (int x = 0; x < (width + 1) / 2; ++x) {
      wrong += row[2 * x] != video_chroma(false, x, y, seed);
      wrong += row[2 * x + 1] != video_chroma(true, x, y, seed);
    }
  }
  EXPECT_EQ(wrong, 0) << what;
}
