// Controls of a camera: units and ranges, automatics, refusals, and that they are set again after a loss.
#include <gtest/gtest.h>

#include <atomic>
#include <climits>
#include <cmath>
#include <tuple>

#include "sources/control_options.h"
#include "sources/registry.h"
#include "support/live_camera_test.h"

namespace {

const std::set<uint32_t> kManualAndAperture = {V4L2_EXPOSURE_MANUAL, V4L2_EXPOSURE_APERTURE_PRIORITY};

class V4l2Controls : public LiveCameraTest {
 protected:
  // Controls of a common USB camera.
  void SetUp() override {
    fake_.controls.all = {{V4L2_CID_EXPOSURE_AUTO, {0, 3, 1, V4L2_EXPOSURE_APERTURE_PRIORITY, 0, kManualAndAperture}},
                          {V4L2_CID_EXPOSURE_ABSOLUTE, {3, 2047, 1, 250}},
                          {V4L2_CID_GAIN, {0, 100, 1, 10}},
                          {V4L2_CID_FOCUS_AUTO, {0, 1, 1, 1}},
                          {V4L2_CID_FOCUS_ABSOLUTE, {1, 254, 5, 51}},
                          {V4L2_CID_AUTO_WHITE_BALANCE, {0, 1, 1, 1}},
                          {V4L2_CID_WHITE_BALANCE_TEMPERATURE, {2800, 6500, 10, 4600}},
                          {V4L2_CID_BRIGHTNESS, {-64, 64, 1, 0}}};
  }
  auto& control(uint32_t id) { return fake_.controls.all.at(id); }
};

TEST_F(V4l2Controls, AreReadInUnitsOfTheApi) {
  const auto opened = camera();
  const std::tuple<maq_source_control, double, double, double, double> expected[] = {
      {MAQ_SOURCE_CONTROL_AUTO_EXPOSURE, 0, 1, 1, 1},
      {MAQ_SOURCE_CONTROL_EXPOSURE, 300, 204700, 100, 25000},
      {MAQ_SOURCE_CONTROL_GAIN, 0, 100, 1, 10},
      {MAQ_SOURCE_CONTROL_AUTO_FOCUS, 0, 1, 1, 1},
      {MAQ_SOURCE_CONTROL_FOCUS, 1, 254, 5, 51},
      {MAQ_SOURCE_CONTROL_AUTO_WHITE_BALANCE, 0, 1, 1, 1},
      {MAQ_SOURCE_CONTROL_WHITE_BALANCE, 2800, 6500, 10, 4600},
      {MAQ_SOURCE_CONTROL_BRIGHTNESS, -64, 64, 1, 0},
  };
  control(V4L2_CID_BRIGHTNESS).value = 33;
  for (const auto& [which, least, most, step, preset] : expected) {
    const maq_source_control_info info = opened->control(which);
    EXPECT_EQ(info.min, least) << which;
    EXPECT_EQ(info.max, most) << which;
    EXPECT_EQ(info.step, step) << which;
    EXPECT_EQ(info.default_value, preset) << which;
    EXPECT_EQ(info.value, which == MAQ_SOURCE_CONTROL_BRIGHTNESS ? 33 : preset) << which;
  }
}

TEST_F(V4l2Controls, AreRoundedToStepsAndSwitchTheirAutomaticOff) {
  fake_.controls.all[V4L2_CID_AUTOGAIN] = {0, 1, 1, 1};
  const struct {
    maq_source_control which;
    double value;
    uint32_t id;
    int expected;
    uint32_t automatic_id;
    int off;
  } table[] = {
      {MAQ_SOURCE_CONTROL_EXPOSURE, 10000, V4L2_CID_EXPOSURE_ABSOLUTE, 100, V4L2_CID_EXPOSURE_AUTO,
       V4L2_EXPOSURE_MANUAL},
      {MAQ_SOURCE_CONTROL_EXPOSURE, 149.9 + 300, V4L2_CID_EXPOSURE_ABSOLUTE, 4, V4L2_CID_EXPOSURE_AUTO,
       V4L2_EXPOSURE_MANUAL},
      {MAQ_SOURCE_CONTROL_GAIN, 5, V4L2_CID_GAIN, 5, V4L2_CID_AUTOGAIN, 0},
      {MAQ_SOURCE_CONTROL_FOCUS, 8.6, V4L2_CID_FOCUS_ABSOLUTE, 11, V4L2_CID_FOCUS_AUTO, 0},
      // The nearest step, 256, is too far.
      {MAQ_SOURCE_CONTROL_FOCUS, 254, V4L2_CID_FOCUS_ABSOLUTE, 251, V4L2_CID_FOCUS_AUTO, 0},
      {MAQ_SOURCE_CONTROL_WHITE_BALANCE, 3004, V4L2_CID_WHITE_BALANCE_TEMPERATURE, 3000, V4L2_CID_AUTO_WHITE_BALANCE,
       0},
      {MAQ_SOURCE_CONTROL_BRIGHTNESS, -64, V4L2_CID_BRIGHTNESS, -64, 0, 0},
  };
  const auto opened = camera();
  for (const auto& row : table) {
    fake_.reset_controls();
    opened->set_control(row.which, row.value);
    EXPECT_EQ(fake_.control(row.id), row.expected) << row.which;
    if (row.automatic_id != 0) {
      EXPECT_EQ(fake_.control(row.automatic_id), row.off) << row.which;
    }
    EXPECT_EQ(opened->control(row.which).value,
              row.which == MAQ_SOURCE_CONTROL_EXPOSURE ? row.expected * 100 : row.expected);
  }
}

TEST_F(V4l2Controls, AutomaticExposureIsWhicheverTheDriverOffers) {
  const auto opened = camera();
  for (const uint32_t on : {V4L2_EXPOSURE_APERTURE_PRIORITY, V4L2_EXPOSURE_AUTO}) {
    for (const uint32_t off : {V4L2_EXPOSURE_MANUAL, V4L2_EXPOSURE_SHUTTER_PRIORITY}) {
      control(V4L2_CID_EXPOSURE_AUTO).items = {on, off};
      opened->set_control(MAQ_SOURCE_CONTROL_AUTO_EXPOSURE, 1);
      EXPECT_EQ(fake_.control(V4L2_CID_EXPOSURE_AUTO), int(on));
      EXPECT_EQ(opened->control(MAQ_SOURCE_CONTROL_AUTO_EXPOSURE).value, 1);
      opened->set_control(MAQ_SOURCE_CONTROL_AUTO_EXPOSURE, 0);
      EXPECT_EQ(fake_.control(V4L2_CID_EXPOSURE_AUTO), int(off));
      EXPECT_EQ(opened->control(MAQ_SOURCE_CONTROL_AUTO_EXPOSURE).value, 0);
    }
  }
  control(V4L2_CID_EXPOSURE_AUTO).items = {V4L2_EXPOSURE_MANUAL};
  EXPECT_EQ(opened->control(MAQ_SOURCE_CONTROL_AUTO_EXPOSURE).max, 0);
  expect_error(MAQ_ERROR_INVALID_ARGUMENT, "goes from 0 to 0, not to 1",
               [&] { opened->set_control(MAQ_SOURCE_CONTROL_AUTO_EXPOSURE, 1); });
  control(V4L2_CID_EXPOSURE_AUTO).items = {};
  expect_error(MAQ_ERROR_UNSUPPORTED, "has no automatic exposure",
               [&] { opened->control(MAQ_SOURCE_CONTROL_AUTO_EXPOSURE); });
}

TEST_F(V4l2Controls, ThatAreNotThereOrOutOfRangeAreRefusedWithTheRange) {
  const auto opened = camera();
  for (const double value : {299.0, 204701.0, -1.0, 1e300, double(NAN), double(INFINITY)}) {
    expect_error(MAQ_ERROR_INVALID_ARGUMENT, "The exposure of /dev/video0 goes from 300 to 204700 microseconds, not to",
                 [&] { opened->set_control(MAQ_SOURCE_CONTROL_EXPOSURE, value); });
  }
  EXPECT_EQ(fake_.control(V4L2_CID_EXPOSURE_AUTO), V4L2_EXPOSURE_APERTURE_PRIORITY) << "nothing was changed";
  control(V4L2_CID_GAIN).flags = V4L2_CTRL_FLAG_DISABLED;
  fake_.controls.all.erase(V4L2_CID_FOCUS_ABSOLUTE);
  for (const maq_source_control which : {MAQ_SOURCE_CONTROL_GAIN, MAQ_SOURCE_CONTROL_FOCUS}) {
    expect_error(MAQ_ERROR_UNSUPPORTED, "/dev/video0 has no ", [&] { opened->set_control(which, 5); });
    expect_error(MAQ_ERROR_UNSUPPORTED, "/dev/video0 has no ", [&] { opened->control(which); });
  }
  control(V4L2_CID_BRIGHTNESS).flags = V4L2_CTRL_FLAG_READ_ONLY;
  expect_error(MAQ_ERROR_BUSY, "read only", [&] { opened->set_control(MAQ_SOURCE_CONTROL_BRIGHTNESS, 5); });
  EXPECT_EQ(opened->control(MAQ_SOURCE_CONTROL_BRIGHTNESS).value, 0);
}

TEST_F(V4l2Controls, WhoseAutomaticIsOffAlreadyDoNotNeedToSwitchIt) {
  control(V4L2_CID_FOCUS_AUTO).value = 0;
  control(V4L2_CID_FOCUS_AUTO).flags = V4L2_CTRL_FLAG_READ_ONLY;
  camera()->set_control(MAQ_SOURCE_CONTROL_FOCUS, 11);
  EXPECT_EQ(fake_.control(V4L2_CID_FOCUS_ABSOLUTE), 11);
}

TEST_F(V4l2Controls, OfADriverThatAnswersNonsenseAreCheckedFirst) {
  const auto opened = camera();
  auto& gain = control(V4L2_CID_GAIN);
  gain = {100, 5, 1, 10};
  expect_error(MAQ_ERROR_UNSUPPORTED, "goes from 100 to 5, which cannot be",
               [&] { opened->control(MAQ_SOURCE_CONTROL_GAIN); });
  expect_error(MAQ_ERROR_UNSUPPORTED, "cannot be", [&] { opened->set_control(MAQ_SOURCE_CONTROL_GAIN, 50); });
  for (const int step : {0, -7, INT_MIN}) {
    gain = {0, 100, step, 10};
    EXPECT_EQ(opened->control(MAQ_SOURCE_CONTROL_GAIN).step, 1);
    opened->set_control(MAQ_SOURCE_CONTROL_GAIN, 42.4);
    EXPECT_EQ(fake_.control(V4L2_CID_GAIN), 42);
  }
  gain = {0, 100, INT_MAX, 1000};
  gain.value = -1000;
  EXPECT_EQ(opened->control(MAQ_SOURCE_CONTROL_GAIN).default_value, 100);
  EXPECT_EQ(opened->control(MAQ_SOURCE_CONTROL_GAIN).value, 0);
  opened->set_control(MAQ_SOURCE_CONTROL_GAIN, 100);
  EXPECT_EQ(fake_.control(V4L2_CID_GAIN), 0) << "the nearest step that is in the range";
  auto& exposure = control(V4L2_CID_EXPOSURE_ABSOLUTE);
  exposure = {INT_MIN, INT_MAX, 1, 0};
  opened->set_control(MAQ_SOURCE_CONTROL_EXPOSURE, 100.0 * INT_MAX);
  EXPECT_EQ(fake_.control(V4L2_CID_EXPOSURE_ABSOLUTE), INT_MAX);
  opened->set_control(MAQ_SOURCE_CONTROL_EXPOSURE, 100.0 * INT_MIN);
  EXPECT_EQ(fake_.control(V4L2_CID_EXPOSURE_ABSOLUTE), INT_MIN);
}

TEST_F(V4l2Controls, EveryFailureIsNamedAndLeavesTheStreamAlone) {
  constexpr maq_status kMissing = MAQ_ERROR_UNSUPPORTED, kBad = MAQ_ERROR_INVALID_ARGUMENT, kBusy = MAQ_ERROR_BUSY,
                       kGone = MAQ_ERROR_DEVICE_LOST;
  const struct {
    const char* name;
    unsigned long call;
    std::vector<std::pair<int, maq_status>> errors;
  } table[] = {
      {"QUERYCTRL",
       VIDIOC_QUERYCTRL,
       {{EINVAL, kMissing}, {ENOTTY, kMissing}, {ENODATA, kMissing}, {EIO, kBusy}, {EACCES, kBusy}, {ENODEV, kGone}}},
      {"G_CTRL",
       VIDIOC_G_CTRL,
       {{EINVAL, kMissing},
        {EACCES, kBusy},
        {EBUSY, kBusy},
        {ENOSPC, kBusy},
        {EIO, kBusy},
        {ERANGE, kBusy},
        {ENXIO, kGone},
        {ENODEV, kGone}}},
      {"S_CTRL",
       VIDIOC_S_CTRL,
       {{EINVAL, kBad},
        {ERANGE, kBad},
        {EACCES, kBusy},
        {EBUSY, kBusy},
        {ENOSPC, kBusy},
        {EIO, kBusy},
        {EILSEQ, kBusy},
        {ETIMEDOUT, kBusy},
        {ENODEV, kGone}}},
  };
  const auto live = source(settings());
  for (const auto& [name, call, errors] : table) {
    for (const auto& [error, status] : errors) {
      SCOPED_TRACE(std::string(name) + " " + std::strerror(error));
      fake_.break_call(call, error);
      expect_error(status, "/dev/video0 ", [&] { live->set_control(MAQ_SOURCE_CONTROL_EXPOSURE, 20000); });
      if (call != VIDIOC_S_CTRL)
        expect_error(status, "/dev/video0 ", [&] { live->control(MAQ_SOURCE_CONTROL_EXPOSURE); });
      fake_.break_call(call, EINTR, 0, 3);
      live->set_control(MAQ_SOURCE_CONTROL_EXPOSURE, 20000);
      fake_.mend();
    }
  }
  ASSERT_TRUE(fake_.deliver(1));
  next(*live);
  EXPECT_EQ(fake_.opened(), 1);
}

TEST_F(V4l2Controls, WhatWasSetIsSetAgainWhenTheCameraIsBack) {
  const auto live = source(settings(), {}, {{MAQ_SOURCE_CONTROL_BRIGHTNESS, 20}, {MAQ_SOURCE_CONTROL_EXPOSURE, 10000}});
  EXPECT_EQ(fake_.control(V4L2_CID_BRIGHTNESS), 20);
  EXPECT_EQ(live->control(MAQ_SOURCE_CONTROL_AUTO_EXPOSURE).value, 0);
  live->set_control(MAQ_SOURCE_CONTROL_BRIGHTNESS, 30);
  live->set_control(MAQ_SOURCE_CONTROL_FOCUS, 11);
  live->set_control(MAQ_SOURCE_CONTROL_AUTO_FOCUS, 1);  // later than the focus, and so later again
  expect_error(MAQ_ERROR_INVALID_ARGUMENT, "goes from", [&] { live->set_control(MAQ_SOURCE_CONTROL_GAIN, 1000); });
  ASSERT_TRUE(fake_.deliver(1));
  const maq::Frame held = next(*live);  // keeps the camera of before
  fake_.unplug();
  ASSERT_TRUE(reports_.wait_for(MAQ_SOURCE_RECONNECTING));
  expect_error(MAQ_ERROR_DEVICE_LOST, "not connected at the moment", [&] { live->control(MAQ_SOURCE_CONTROL_GAIN); });
  expect_error(MAQ_ERROR_DEVICE_LOST, "not connected at the moment",
               [&] { live->set_control(MAQ_SOURCE_CONTROL_GAIN, 5); });
  fake_.reset_controls();
  fake_.plug();
  ASSERT_TRUE(reports_.wait_for(MAQ_SOURCE_RECONNECTED));
  EXPECT_EQ(fake_.control(V4L2_CID_BRIGHTNESS), 30);
  EXPECT_EQ(fake_.control(V4L2_CID_EXPOSURE_AUTO), V4L2_EXPOSURE_MANUAL);
  EXPECT_EQ(fake_.control(V4L2_CID_EXPOSURE_ABSOLUTE), 100);
  EXPECT_EQ(fake_.control(V4L2_CID_FOCUS_ABSOLUTE), 11);
  EXPECT_EQ(fake_.control(V4L2_CID_FOCUS_AUTO), 1);
  EXPECT_EQ(fake_.control(V4L2_CID_GAIN), 10);
  EXPECT_EQ(live->control(MAQ_SOURCE_CONTROL_BRIGHTNESS).value, 30);
}

TEST_F(V4l2Controls, WhatCannotBeSetAgainIsLoggedAndTheCameraIsBack) {
  static std::mutex mutex;
  static std::string log;
  maq::SourceSettings logging = settings();
  logging.log = maq::Log(
      MAQ_LOG_WARNING,
      [](void*, maq_log_level, const char* text) {
        std::lock_guard<std::mutex> lock(mutex);
        log += std::string(text) + "\n";
      },
      nullptr);
  const auto live = source(logging, {}, {{MAQ_SOURCE_CONTROL_BRIGHTNESS, 20}, {MAQ_SOURCE_CONTROL_GAIN, 20}});
  fake_.unplug();
  ASSERT_TRUE(reports_.wait_for(MAQ_SOURCE_RECONNECTING));
  fake_.controls.all.erase(V4L2_CID_BRIGHTNESS);
  fake_.reset_controls();
  fake_.plug();
  ASSERT_TRUE(reports_.wait_for(MAQ_SOURCE_RECONNECTED));
  EXPECT_EQ(fake_.control(V4L2_CID_GAIN), 20);
  std::lock_guard<std::mutex> lock(mutex);
  EXPECT_NE(log.find("back without one of its controls: /dev/video0 has no brightness."), std::string::npos) << log;
}

TEST_F(V4l2Controls, ThatCannotBeSetWhenASourceOpensAreItsErrorAndLeaveNothingOpen) {
  expect_error(MAQ_ERROR_INVALID_ARGUMENT, "goes from", [&] {
    source(settings(), {}, {{MAQ_SOURCE_CONTROL_GAIN, 1000}});
  });
  expect_nothing_left();
}

TEST_F(V4l2Controls, OfACameraThatStaysAwayAreLostWithIt) {
  maq::SourceSettings impatient = settings();
  impatient.reconnect_ms = 0;
  const auto live = source(impatient);
  fake_.unplug();
  maq::Frame frame;
  expect_error(MAQ_ERROR_DEVICE_LOST, "did not come back", [&] { live->next(kLimit, frame); });
  expect_error(MAQ_ERROR_DEVICE_LOST, "did not come back", [&] { live->control(MAQ_SOURCE_CONTROL_GAIN); });
}

// A device that takes its time for each control.
class SlowV4l2 : public FakeV4l2 {
 public:
  int ioctl(int fd, unsigned long request, void* argument) override {
    if (request == VIDIOC_S_CTRL) {
      is_asked = true;
      std::unique_lock<std::mutex> lock(hang);
    }
    return FakeV4l2::ioctl(fd, request, argument);
  }
  std::mutex hang;
  std::atomic<bool> is_asked{false};
};

TEST_F(V4l2Controls, ThatTakeLongDelayNeitherFramesNorReconnecting) {
  SlowV4l2 device;
  device.controls = fake_.controls;
  auto live = std::make_unique<maq::LiveSource>([&] { return maq::open_v4l2_camera(device, "/dev/video0", {}, 4); },
                                                "/dev/video0", settings());
  std::unique_lock<std::mutex> hang(device.hang);
  std::thread other(
      [&] { expect_error(MAQ_ERROR_DEVICE_LOST, "", [&] { live->set_control(MAQ_SOURCE_CONTROL_BRIGHTNESS, 20); }); });
  while (!device.is_asked) std::this_thread::sleep_for(1ms);
  for (int i = 0; i < 20; ++i) {
    ASSERT_TRUE(device.deliver(1));
    next(*live);
  }
  device.unplug();
  EXPECT_TRUE(reports_.wait_for(MAQ_SOURCE_RECONNECTING));
  device.plug();
  EXPECT_TRUE(reports_.wait_for(MAQ_SOURCE_RECONNECTED));
  hang.unlock();
  other.join();
  live.reset();
  wait_until_closed(device);
}

TEST_F(V4l2Controls, AreSetByManyThreadsWhileTheCameraComesAndGoes) {
  const auto live = source(settings());
  std::atomic<bool> done{false};
  std::vector<std::thread> threads;
  for (int k = 0; k < 3; ++k) {
    threads.emplace_back([&, k] {
      for (int i = 0; !done; ++i) {
        try {
          live->set_control(k == 0 ? MAQ_SOURCE_CONTROL_GAIN : MAQ_SOURCE_CONTROL_BRIGHTNESS, i % 60);
          EXPECT_GE(live->control(MAQ_SOURCE_CONTROL_GAIN).value, 0);
        } catch (const maq::Error& error) {
          EXPECT_EQ(error.status(), MAQ_ERROR_DEVICE_LOST) << error.what();
        }
        std::this_thread::sleep_for(1ms);
      }
    });
  }
  for (int i = 0; i < 3; ++i) {
    std::this_thread::sleep_for(50ms);
    fake_.unplug();
    std::this_thread::sleep_for(50ms);
    fake_.plug();
    std::this_thread::sleep_for(200ms);
  }
  done = true;
  for (std::thread& thread : threads) thread.join();
}

TEST_F(V4l2Controls, ComeFromTheUri) {
  const auto parsed = [](const std::string& query) {
    maq::SourceUri uri = maq::parse_source_uri("v4l2:/dev/video0?fps=30" + query);
    std::string text;
    for (const auto& [which, value] : maq::take_control_options(uri)) text += maq::concatenate(which, "=", value, " ");
    EXPECT_TRUE(uri.options.empty());
    return text;
  };
  EXPECT_EQ(parsed(""), "");
  EXPECT_EQ(parsed("&exposure=auto&gain=auto&focus=auto&white_balance=auto"), "1=1 1=1 4=1 6=1 ");
  EXPECT_EQ(parsed("&brightness=-7.5&white_balance=4000&focus=3&gain=2&exposure=10000"),
            "2=10000 3=2 5=3 7=4000 8=-7.5 ");
  EXPECT_EQ(parsed("&gain=12&exposure=auto"), "1=1 3=12 ");
  for (const char* bad :
       {"exposure=", "exposure=much", "gain=1e999", "focus=nan", "white_balance=12K", "brightness=auto"}) {
    expect_error(MAQ_ERROR_INVALID_ARGUMENT, bad, [&] { parsed(std::string("&") + bad); });
  }
  expect_error(MAQ_ERROR_INVALID_ARGUMENT, "must be a number or auto.", [&] { parsed("&exposure=much"); });
  expect_error(MAQ_ERROR_INVALID_ARGUMENT, "leaves the exposure to the device",
               [&] { parsed("&exposure=9&gain=auto"); });
  expect_error(MAQ_ERROR_INVALID_ARGUMENT, "white_balance and brightness",
               [&] { maq::open_source("v4l2:/no/such?contrast=3"); });
  expect_error(MAQ_ERROR_NOT_FOUND, "/no/such", [&] { maq::open_source("v4l2:/no/such?exposure=300&gain=3"); });
}

}  // namespace
