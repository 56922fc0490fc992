// A live source on a driver in memory.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "sources/live_source.h"
#include "sources/v4l2/v4l2_camera.h"
#include "support/expect_error.h"
#include "support/fakes/fake_v4l2.h"
#include "support/source_threads.h"
#include "support/state_reports.h"
#include "support/wait_until.h"

using namespace std::chrono_literals;
using maq::NextFrame;

class LiveCameraTest : public ::testing::Test {
 protected:
  std::shared_ptr<maq::Camera> camera(const maq::CameraRequest& request = {}) {
    return maq::open_v4l2_camera(fake_, "/dev/video0", request, 4);
  }
  maq::SourceSettings settings() {
    maq::SourceSettings settings;
    settings.on_state = Reports::note;
    settings.user_data = &reports_;
    return settings;
  }
  std::unique_ptr<maq::LiveSource> source(const maq::SourceSettings& settings, const maq::CameraRequest& request = {},
                                          const std::vector<maq::ControlSetting>& controls = {}) {
    const auto open = [this, request] { return maq::open_v4l2_camera(fake_, "/dev/video0", request, 6); };
    return std::make_unique<maq::LiveSource>(open, "/dev/video0", settings, controls);
  }
  void TearDown() override { wait_until_closed(fake_); }

  // On a busy machine a source's thread may need longer to end than its source waits.
  static void wait_until_closed(const FakeV4l2& fake) {
    wait_until([&] { return fake.mappings() == 0; });
    EXPECT_EQ(fake.open_files(), 0);
    EXPECT_EQ(fake.mappings(), 0);
    EXPECT_EQ(fake.exported(), 0u);
  }
  void expect_nothing_left() {
    EXPECT_EQ(fake_.open_files(), 0);
    EXPECT_EQ(fake_.mappings(), 0);
    EXPECT_EQ(fake_.exported(), 0u);
  }

  // The next frame, which must come.
  maq::Frame next(maq::LiveSource& live) {
    maq::Frame frame;
    EXPECT_EQ(live.next(kLimit, frame), NextFrame::kFrame);
    return frame;
  }

  FakeV4l2 fake_;
  Reports reports_;
};
