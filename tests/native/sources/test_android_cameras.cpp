// Cameras of Android, on an Android in memory: frames, every failure of every function, and the ends of a camera.
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <memory>
#include <string>
#include <thread>
#include <tuple>
#include <vector>

#include "core/clock.h"
#include "core/unique_fd.h"
#include "sources/android/camera2_camera.h"
#include "sources/android/camera2_characteristics.h"
#include "sources/android/camera2_errors.h"
#include "sources/live_source.h"
#include "support/expect_error.h"
#include "support/fake_camera2.h"
#include "support/source_threads.h"
#include "support/state_reports.h"
#include "support/wait_until.h"

namespace {

namespace ndk = maq::ndk;
using Event = maq::Camera::Event;
using Layout = FakeCamera2::Layout;
using maq::NextFrame;

constexpr int kBuffers = 4;

class AndroidCameras : public ::testing::Test {
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

  // What wait() says, at once.
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
int video_luma(int x, int y, uint8_t seed) {
  return int(std::lround(16 + FakeCamera2::luma(x, y, seed) * 219.0 / 255));
}
int video_chroma(bool is_v, int x, int y, uint8_t seed) {
  return int(std::lround(16 + FakeCamera2::chroma(is_v, x, y, seed) * 224.0 / 255));
}

void expect_pixels(const maq::ImageView& image, int width, int height, uint8_t seed, const std::string& what) {
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

TEST_F(AndroidCameras, EveryLayoutOfPlanesComesAsNv12InVideoRange) {
  const auto opened = camera();
  uint8_t seed = 0;
  for (const Layout layout : {Layout::kVu, Layout::kUv, Layout::kPlanar, Layout::kOdd}) {
    for (const int padding : {0, 24}) {
      for (const auto& [width, height] :
           {std::pair(320, 240), std::pair(33, 17), std::pair(1, 1), std::pair(640, 480)}) {
        fake_.layout = layout;
        fake_.padding = padding;
        fake_.size = {width, height};
        const Answer answer = frame(*opened, ++seed);
        const std::string what = maq::concatenate(int(layout), " ", padding, " ", width, " x ", height);
        expect_pixels(answer.buffer.image, width, height, seed, what);
        EXPECT_EQ(answer.buffer.sequence, seed);
        opened->give_back(answer.buffer.slot);
      }
    }
  }
}

// Of an image, row by row; rotated by 90 degrees clockwise.
struct Grid {
  int columns, rows;
  std::vector<int> values;
  int at(int x, int y) const { return values[size_t(y) * size_t(columns) + size_t(x)]; }
};
Grid rotated_clockwise(const Grid& grid) {
  Grid rotated{grid.rows, grid.columns, {}};
  for (int y = 0; y < rotated.rows; ++y) {
    for (int x = 0; x < rotated.columns; ++x) rotated.values.push_back(grid.at(y, grid.rows - 1 - x));
  }
  return rotated;
}

TEST_F(AndroidCameras, PicturesAreUprightOnTheDisplay) {
  constexpr int kWidth = 75, kHeight = 46;
  fake_.size = {kWidth, kHeight};
  uint8_t seed = 0;
  for (const int orientation : {0, 90, 180, 270}) {
    for (auto& of_device : fake_.cameras) {
      of_device.metadata.set<int32_t>(ndk::ACAMERA_SENSOR_ORIENTATION, {orientation});
    }
    for (const int display : {0, 90, 180, 270}) {
      for (const std::string name : {"back", "front"}) {
        for (const Layout layout : {Layout::kVu, Layout::kPlanar, Layout::kOdd}) {
          fake_.layout = layout;
          const int turns = (orientation + (name == "front" ? display : 360 - display)) / 90 % 4;
          Grid luma{kWidth, kHeight, {}}, u{(kWidth + 1) / 2, kHeight / 2, {}}, v = u;
          ++seed;
          for (int i = 0; i < kWidth * kHeight; ++i) {
            luma.values.push_back(video_luma(i % kWidth, i / kWidth, seed));
          }
          for (int i = 0; i < u.columns * u.rows; ++i) {
            u.values.push_back(video_chroma(false, i % u.columns, i / u.columns, seed));
            v.values.push_back(video_chroma(true, i % u.columns, i / u.columns, seed));
          }
          for (int i = 0; i < turns; ++i) {
            for (Grid* grid : {&luma, &u, &v}) *grid = rotated_clockwise(*grid);
          }
          const auto opened = camera({"", 320, 240, 0}, name, display);
          EXPECT_EQ(opened->format().width_px, turns % 2 == 0 ? 320 : 240);
          const Answer answer = frame(*opened, seed);
          const maq::ImageView& image = answer.buffer.image;
          ASSERT_EQ(image.width_px, luma.columns);
          ASSERT_EQ(image.height_px, luma.rows);
          int wrong = 0;
          for (int i = 0; i < kWidth * kHeight; ++i) wrong += image.planes[0].data[i] != luma.values[size_t(i)];
          for (int i = 0; i < u.columns * u.rows; ++i) {
            wrong += image.planes[1].data[2 * i] != u.values[size_t(i)];
            wrong += image.planes[1].data[2 * i + 1] != v.values[size_t(i)];
          }
          EXPECT_EQ(wrong, 0) << name << " camera of " << orientation << " degrees, display of " << display;
          opened->give_back(answer.buffer.slot);
        }
      }
    }
  }
}

TEST_F(AndroidCameras, TheNearestSizeAndRateAreTaken) {
  const struct {
    maq::CameraRequest request;
    int width, height;
    double fps;
    std::pair<int, int> rates;
  } table[] = {{{}, 640, 480, 30, {7, 30}},  // the device's own rate
               {{"", 300, 200, 0}, 320, 240, 30, {7, 30}},
               {{"", 4000, 3000, 30}, 1280, 720, 20, {30, 30}},  // which takes 50 ms a frame
               {{"", 640, 480, 15}, 640, 480, 15, {15, 15}},
               {{"", 640, 480, 29}, 640, 480, 30, {30, 30}}};
  for (const auto& row : table) {
    const auto opened = camera(row.request);
    EXPECT_EQ(opened->format().pixels, MAQ_PIXEL_NV12);
    EXPECT_EQ(opened->format().width_px, row.width);
    EXPECT_EQ(opened->format().height_px, row.height);
    EXPECT_EQ(opened->format().fps, row.fps);
    EXPECT_EQ(fake_.rates(), row.rates);
  }
}

TEST_F(AndroidCameras, RatesInThousandthsAreUnderstood) {
  fake_.cameras[0].metadata.set<int32_t>(ndk::ACAMERA_CONTROL_AE_AVAILABLE_TARGET_FPS_RANGES,
                                         {15000, 15000, 30000, 30000, 0, 5000, 9000, 8000});
  const auto opened = camera({"", 320, 240, 14});
  EXPECT_EQ(fake_.rates(), std::pair(15000, 15000));
  EXPECT_EQ(opened->format().fps, 15);
}

TEST_F(AndroidCameras, AreOpenedByIdNumberAndFacing) {
  fake_.cameras = {FakeCamera2::camera("10", ndk::ACAMERA_LENS_FACING_FRONT),
                   FakeCamera2::camera("0", ndk::ACAMERA_LENS_FACING_BACK),
                   FakeCamera2::camera("usb", ndk::ACAMERA_LENS_FACING_EXTERNAL)};
  for (const auto& [name, id] : {std::pair("10", "10"), std::pair("0", "0"), std::pair("1", "0"), std::pair("2", "usb"),
                                 std::pair("front", "10"), std::pair("back", "0"), std::pair("external", "usb")}) {
    EXPECT_EQ(camera({}, name)->identity(), std::string("android:") + id) << name;
    EXPECT_EQ(fake_.opened_id(), id) << name;
  }
  for (const char* name : {"3", "side", "-1", "99999999999999999999", "0 ", "Front"}) {
    expect_error(MAQ_ERROR_NOT_FOUND, "it has 10 (front), 0 (back), usb (external)", [&] { camera({}, name); });
  }
  fake_.cameras.clear();
  expect_error(MAQ_ERROR_NOT_FOUND, "it has none", [&] { camera(); });
}

TEST_F(AndroidCameras, AreListedWithTheirSizesAndTheirProblems) {
  fake_.cameras.push_back({"2", {}});
  const auto found = maq::list_android_cameras(functions_);
  ASSERT_EQ(found.size(), 3u);
  EXPECT_EQ(found[1].uri, "android:1");
  EXPECT_EQ(found[1].name, "front camera");
  ASSERT_EQ(found[1].modes.size(), 4u);  // neither JPEG nor an input
  EXPECT_EQ(found[1].modes[0].width_px, 1280);
  EXPECT_EQ(found[1].modes[0].fps, 20);
  EXPECT_EQ(found[1].modes[1].fps, 30);
  EXPECT_EQ(found[2].name, "camera");
  EXPECT_TRUE(found[2].modes.empty());
  fake_.break_call("ACameraManager_getCameraCharacteristics", ndk::ACAMERA_ERROR_CAMERA_DISCONNECTED, 1, 1);
  const auto broken = maq::list_android_cameras(functions_);
  ASSERT_EQ(broken.size(), 3u);
  EXPECT_EQ(broken[0].status, MAQ_OK);
  EXPECT_EQ(broken[1].status, MAQ_ERROR_DEVICE_LOST);
  EXPECT_NE(broken[1].problem.find("not connected"), std::string::npos) << broken[1].problem;
}

TEST_F(AndroidCameras, WhatTheyCannotDoIsASentence) {
  fake_.cameras.push_back({"2", {}});
  expect_error(MAQ_ERROR_UNSUPPORTED, "android:2 offers no pictures for processing", [&] { camera({}, "2"); });
  // Metadata that cannot be is as good as none.
  auto& odd = fake_.cameras[2].metadata;
  odd.set<int32_t>(ndk::ACAMERA_SCALER_AVAILABLE_STREAM_CONFIGURATIONS,
                   {0x23, -640, 480, 0, 0x23, 0, 0, 0, 0x23, 1 << 30, 1 << 30, 0, 0x23, 640, 480});
  expect_error(MAQ_ERROR_UNSUPPORTED, "offers no pictures", [&] { camera({}, "2"); });
  odd.set<int64_t>(ndk::ACAMERA_SCALER_AVAILABLE_STREAM_CONFIGURATIONS, {0x23, 640, 480, 0});
  expect_error(MAQ_ERROR_UNSUPPORTED, "offers no pictures", [&] { camera({}, "2"); });
  odd.set<int32_t>(ndk::ACAMERA_SCALER_AVAILABLE_STREAM_CONFIGURATIONS, {0x23, 640, 480, 0});
  odd.set<uint8_t>(ndk::ACAMERA_LENS_FACING, {77});
  EXPECT_EQ(camera({"", 0, 0, 30}, "2")->format().width_px, 640);
  expect_error(MAQ_ERROR_UNSUPPORTED, "has no", [&] { camera()->set_control(MAQ_CONTROL_EXPOSURE, 1); });
}

TEST_F(AndroidCameras, SayWhatToDo) {
  const std::tuple<int, maq_status, const char*> table[] = {
      {ndk::ACAMERA_ERROR_PERMISSION_DENIED, MAQ_ERROR_NO_PERMISSION, "Grant android.permission.CAMERA"},
      {ndk::ACAMERA_ERROR_CAMERA_DISABLED, MAQ_ERROR_NO_PERMISSION, "foreground"},
      {ndk::ACAMERA_ERROR_CAMERA_IN_USE, MAQ_ERROR_BUSY, "Another app"},
      {ndk::ACAMERA_ERROR_MAX_CAMERA_IN_USE, MAQ_ERROR_BUSY, "Close another camera"},
      {ndk::ACAMERA_ERROR_CAMERA_DISCONNECTED, MAQ_ERROR_DEVICE_LOST, "not connected"},
      {ndk::ACAMERA_ERROR_CAMERA_DEVICE, MAQ_ERROR_DEVICE_LOST, "camera device failed"},
      {ndk::ACAMERA_ERROR_CAMERA_SERVICE, MAQ_ERROR_DEVICE_LOST, "camera service failed"},
      {ndk::ACAMERA_ERROR_NOT_ENOUGH_MEMORY, MAQ_ERROR_OUT_OF_MEMORY, "smaller size"},
      {ndk::ACAMERA_ERROR_UNKNOWN, MAQ_ERROR_UNSUPPORTED, "camera_status_t -10000"},
      {-12345, MAQ_ERROR_UNSUPPORTED, "camera_status_t -12345"}};
  for (const auto& [error, status, text] : table) {
    fake_.break_call("ACameraManager_openCamera", error);
    expect_error(status, text, [&] { camera(); });
    expect_error(status, "android:0 cannot be opened: ", [&] { camera(); });
  }
}

std::vector<std::string> names_of_functions() {
  return {
#define MAQ_FUNCTION(name, signature) #name,
      MAQ_FUNCTIONS_OF_CAMERA2NDK(MAQ_FUNCTION) MAQ_FUNCTIONS_OF_MEDIANDK(MAQ_FUNCTION)
#undef MAQ_FUNCTION
  };
}

bool ends_with(const std::string& text, const std::string& end) {
  return text.size() >= end.size() && text.compare(text.size() - end.size(), end.size(), end) == 0;
}

// Functions that return nothing cannot fail.
bool can_fail(const std::string& name) {
  return !ends_with(name, "_delete") && !ends_with(name, "_free") && !ends_with(name, "IdList") &&
         name != "ACameraCaptureSession_close";
}

TEST_F(AndroidCameras, EveryFailureOfEveryFunctionIsNamedAndLeavesNothing) {
  // Without these a camera opens all the same.
  const std::vector<std::string> harmless = {"ACameraDevice_close", "ACaptureRequest_getConstEntry",
                                             "ACaptureRequest_setEntry_i32"};
  int failures = 0;
  for (const std::string& name : names_of_functions()) {
    if (!can_fail(name) && name != "ACameraManager_getCameraIdList") continue;
    const bool is_of_images = name.rfind("AImage_", 0) == 0 || ends_with(name, "acquireNextImage");
    const bool is_harmless = is_of_images || std::count(harmless.begin(), harmless.end(), name) != 0;
    for (const int error : {ndk::ACAMERA_ERROR_CAMERA_DEVICE, ndk::ACAMERA_ERROR_UNKNOWN, ndk::camera_status_t(-1)}) {
      for (const int after : {0, 1, 2, 3}) {
        fake_.break_call(name, error, after);
        const std::string what = maq::concatenate(name, " ", error, " after ", after);
        try {
          const auto opened = camera({"", 320, 240, 30}, "back");
          EXPECT_TRUE(is_harmless || after > 0) << what;
        } catch (const maq::Error& failure) {
          ++failures;
          EXPECT_FALSE(is_harmless) << what;
          EXPECT_NE(failure.status(), MAQ_ERROR_INTERNAL) << what;
          const std::string text = failure.what();
          EXPECT_TRUE(text.rfind("android:", 0) == 0 || text.rfind("Android ", 0) == 0) << text;
          EXPECT_EQ(text.back(), '.') << text;
        }
        expect_nothing_left(what);
        fake_.break_call(name, error, after);
        try {
          maq::list_android_cameras(functions_);
        } catch (const maq::Error& failure) {
          EXPECT_TRUE(after == 0 && name.rfind("ACameraManager_", 0) == 0) << what << ": " << failure.what();
        }
        expect_nothing_left(what);
        fake_.mend();
      }
    }
  }
  EXPECT_GE(failures, 3 * 15);
}

TEST_F(AndroidCameras, ImagesThatCannotBeReadAreLostAndOnlyManyOfThemLoseTheCamera) {
  const auto opened = camera();
  uint32_t sequence = 0;
  for (const char* name : {"AImage_getWidth", "AImage_getHeight", "AImage_getTimestamp", "AImage_getPlaneData",
                           "AImage_getPlanePixelStride", "AImage_getPlaneRowStride", "AImageReader_acquireNextImage"}) {
    fake_.break_call(name, ndk::AMEDIA_IMGREADER_CANNOT_LOCK_IMAGE, 0, 1);
    ASSERT_TRUE(fake_.deliver(1));
    EXPECT_EQ(wait(*opened).event, Event::kTimeout) << name;
    const Answer whole = frame(*opened, 2);
    EXPECT_EQ(whole.buffer.sequence, sequence += 2) << name;
    opened->give_back(whole.buffer.slot);
  }
  fake_.break_call("AImage_getPlaneData", ndk::AMEDIA_IMGREADER_CANNOT_LOCK_IMAGE);
  Answer last{};
  int images = 0;
  do {
    ASSERT_TRUE(fake_.deliver(1));
    last = wait(*opened);
  } while (last.event == Event::kTimeout && ++images < 1000);
  EXPECT_EQ(last.event, Event::kLost);
  EXPECT_EQ(last.reason, "its images cannot be read: media_status_t -30003");
}

TEST_F(AndroidCameras, PlanesThatCannotBeAreNotRead) {
  const auto opened = camera();
  const auto expect_bad = [&](const std::string& what) {
    ASSERT_TRUE(fake_.deliver(1));
    EXPECT_EQ(wait(*opened).event, Event::kTimeout) << what;
  };
  for (const int32_t stride : {0, -1, 100, INT32_MIN, INT32_MAX}) {
    fake_.row_stride = stride;
    expect_bad(maq::concatenate("rows ", stride));
    fake_.row_stride.reset();
    if (stride == 100) continue;
    fake_.pixel_stride = stride;
    expect_bad(maq::concatenate("pixels ", stride));
    fake_.pixel_stride.reset();
  }
  fake_.missing_bytes = 1;
  expect_bad("a byte too few");
  fake_.missing_bytes = 0;
  fake_.has_null_plane = true;
  expect_bad("no memory");
  fake_.has_null_plane = false;
  for (const auto& size : {std::pair(0, 240), std::pair(20000, 1)}) {
    fake_.size = size;
    expect_bad("size");
  }
  fake_.size.reset();
  expect_pixels(frame(*opened, 9).buffer.image, 320, 240, 9, "after them");
}

TEST_F(AndroidCameras, FramesThatTheAppHoldsKeepTheirPixelsAndStopNothing) {
  auto opened = camera();
  std::vector<Answer> held;
  for (uint8_t seed = 1; seed <= kBuffers; ++seed) held.push_back(frame(*opened, seed));
  // Further images are lost, but none stays with the reader: Android would stop.
  for (int i = 0; i < 20; ++i) {
    ASSERT_TRUE(fake_.deliver(99)) << i;
    EXPECT_EQ(wait(*opened).event, Event::kTimeout);
  }
  opened->give_back(held[1].buffer.slot);
  const Answer later = frame(*opened, 77);
  EXPECT_EQ(later.buffer.sequence, kBuffers + 21u);
  EXPECT_EQ(later.buffer.slot, held[1].buffer.slot);
  held[1] = later;
  opened->close();
  expect_nothing_left("closed while frames are held");
  for (size_t i = 0; i < held.size(); ++i) {
    expect_pixels(held[i].buffer.image, 320, 240, i == 1 ? 77 : uint8_t(i + 1), maq::concatenate("frame ", i));
    opened->give_back(held[i].buffer.slot);
  }
}

TEST_F(AndroidCameras, FramesThatTheDeviceLosesLeaveGaps) {
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

TEST_F(AndroidCameras, LateCallbacksDoNothing) {
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

TEST_F(AndroidCameras, WaitingEndsByImageWakeTimeoutAndLoss) {
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

TEST_F(AndroidCameras, EachErrorOfALostCameraIsAReason) {
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

TEST_F(AndroidCameras, ACameraThatIsTakenAwayComesBack) {
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

TEST_F(AndroidCameras, CloseWhileAndroidCallsBack) {
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

TEST_F(AndroidCameras, CloseFromAnotherThreadEndsAWait) {
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

TEST_F(AndroidCameras, AThousandTimesOpenedNothingIsLeft) {
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

TEST_F(AndroidCameras, TimesAreOfTheMonotonicClock) {
  constexpr int64_t kNow = 5000 * kSecond, kAsleep = 777 * kSecond;
  EXPECT_EQ(maq::camera2_time_ns(kNow - 20, std::nullopt, kNow), kNow - 20);
  EXPECT_EQ(maq::camera2_time_ns(kNow + kAsleep - 20, kNow + kAsleep, kNow), kNow - 20);
  // What cannot be is the time of arrival.
  for (const int64_t stamp : {kNow + 1, kNow - 11 * kSecond, int64_t(0), int64_t(-1), INT64_MIN, INT64_MAX}) {
    EXPECT_EQ(maq::camera2_time_ns(stamp, std::nullopt, kNow), kNow) << stamp;
  }
  EXPECT_EQ(maq::camera2_time_ns(kNow - 20, kNow + kAsleep, kNow), kNow) << "of the other clock";

  fake_.cameras[0].metadata.set<uint8_t>(ndk::ACAMERA_SENSOR_INFO_TIMESTAMP_SOURCE,
                                         {ndk::ACAMERA_SENSOR_INFO_TIMESTAMP_SOURCE_REALTIME});
  const auto opened = camera();
  timespec boot{};
  clock_gettime(CLOCK_BOOTTIME, &boot);
  const int64_t before = maq::monotonic_ns();
  fake_.timestamp_ns = int64_t(boot.tv_sec) * kSecond + boot.tv_nsec - kSecond;
  const int64_t taken = frame(*opened, 1).buffer.timestamp_ns;
  EXPECT_NEAR(double(taken - before), -double(kSecond), 0.1 * double(kSecond));
}

TEST_F(AndroidCameras, IntrinsicsAreThoseOfThePicture) {
  EXPECT_EQ(camera()->intrinsics(), nullptr);
  auto& metadata = fake_.cameras[0].metadata;
  metadata.set<float>(ndk::ACAMERA_LENS_INTRINSIC_CALIBRATION, {3000, 3100, 2010, 1490, 0});
  EXPECT_EQ(camera()->intrinsics(), nullptr) << "of a sensor without a size";
  metadata.set<int32_t>(ndk::ACAMERA_SENSOR_INFO_ACTIVE_ARRAY_SIZE, {8, 8, 4000, 3000});
  metadata.set<float>(ndk::ACAMERA_LENS_DISTORTION, {0.1F, 0.2F, 0.3F, 0.4F, 0.5F});
  const auto expect_lens = [&](const maq::CameraRequest& request, double fx, double fy, double cx, double cy) {
    const auto opened = camera(request);
    ASSERT_NE(opened->intrinsics(), nullptr);
    const maq_intrinsics& found = *opened->intrinsics();
    EXPECT_EQ(found.width_px, opened->format().width_px);
    EXPECT_NEAR(found.fx_px, fx, 1e-6);
    EXPECT_NEAR(found.fy_px, fy, 1e-6);
    EXPECT_NEAR(found.cx_px, cx, 1e-6);
    EXPECT_NEAR(found.cy_px, cy, 1e-6);
  };
  // The whole sensor; (0, 0) is the centre of the first pixel.
  expect_lens({"", 640, 480, 0}, 480, 496, 321.6 - 0.5, 238.4 - 0.5);
  // The middle of it: 4000 x 2250.
  expect_lens({"", 1280, 720, 0}, 960, 992, 643.2 - 0.5, 356.8 - 0.5);
  auto opened = camera();
  const std::vector<double> expected = {0.1, 0.2, 0.4, 0.5, 0.3, 0, 0, 0};
  for (int i = 0; i < 8; ++i) EXPECT_NEAR(opened->intrinsics()->distortion[i], expected[size_t(i)], 1e-6) << i;
  opened.reset();
  // A device that corrects distortion fits a larger part of the sensor to the same pixels.
  metadata.set<int32_t>(ndk::ACAMERA_SENSOR_INFO_PRE_CORRECTION_ACTIVE_ARRAY_SIZE, {0, 0, 4020, 3020});
  metadata.set<uint8_t>(ndk::ACAMERA_DISTORTION_CORRECTION_AVAILABLE_MODES, {0, 1, 2});
  expect_lens({"", 640, 480, 0}, 480 * 4000 / 4020.0, 496 * 3000 / 3020.0, 320 - 0.5,
              240 - 0.16 * 20 * 3000 / 3020 - 0.5);
  EXPECT_EQ(camera()->intrinsics()->distortion[0], 0);
  for (const std::vector<float>& bad :
       {std::vector<float>{0, 1, 1, 1, 0}, {1, -1, 1, 1, 0}, {NAN, 1, 1, 1, 0}, {1, 1}}) {
    metadata.set<float>(ndk::ACAMERA_LENS_INTRINSIC_CALIBRATION, bad);
    EXPECT_EQ(camera()->intrinsics(), nullptr);
  }
}

// Where a direction is seen in the picture (OpenCV's model of a lens).
std::pair<double, double> projected(const maq_intrinsics& lens, double x, double y) {
  const double *k = lens.distortion, r2 = x * x + y * y;
  const double radial = 1 + r2 * (k[0] + r2 * (k[1] + r2 * k[4]));
  const double across = x * radial + 2 * k[2] * x * y + k[3] * (r2 + 2 * x * x);
  const double down = y * radial + k[2] * (r2 + 2 * y * y) + 2 * k[3] * x * y;
  return {lens.cx_px + lens.fx_px * across, lens.cy_px + lens.fy_px * down};
}

TEST_F(AndroidCameras, IntrinsicsRotateWithThePicture) {
  maq_intrinsics lens{};
  lens.width_px = 640;
  lens.height_px = 480;
  lens.fx_px = 500;
  lens.fy_px = 520;
  lens.cx_px = 330;
  lens.cy_px = 225;
  const double distortion[] = {.1, -.05, .01, .02, .03};
  std::copy(std::begin(distortion), std::end(distortion), lens.distortion);
  maq_intrinsics before = lens;
  double x = .31, y = -.22;
  for (int turns = 1; turns <= 4; ++turns) {
    const maq_intrinsics rotated = maq::rotated_intrinsics(lens, turns);
    const auto [u, v] = projected(before, x, y);
    std::tie(x, y) = std::pair(-y, x);
    const auto [rotated_u, rotated_v] = projected(rotated, x, y);
    EXPECT_NEAR(rotated_u, before.height_px - 1 - v, 1e-9);
    EXPECT_NEAR(rotated_v, u, 1e-9);
    EXPECT_EQ(rotated.width_px, before.height_px);
    before = rotated;
  }
  EXPECT_EQ(before.cx_px, lens.cx_px);
}

TEST_F(AndroidCameras, OptionsOfTheUriAreChecked) {
  expect_error(MAQ_ERROR_INVALID_ARGUMENT, "display=45",
               [] { maq::android_uri_opener(maq::parse_source_uri("android:back?display=45"), 4, {}); });
  maq::SourceUri uri = maq::parse_source_uri("android:back?size=640x480&fps=30&zoom=2");
  expect_error(MAQ_ERROR_INVALID_ARGUMENT, "zoom", [&] { maq::android_uri_opener(uri, 4, {}); });
}

TEST_F(AndroidCameras, WithoutAndroidTheLibraryIsNamed) {
  const auto open = maq::android_uri_opener(maq::parse_source_uri("android:0"), 4, {});
  expect_error(MAQ_ERROR_RUNTIME_LIBRARY, "libcamera2ndk.so", [&] { open(); });
  EXPECT_TRUE(maq::list_android_cameras().empty());
  expect_error(MAQ_ERROR_RUNTIME_LIBRARY, "the function ACameraManager_create, which libc.so.6 does not have",
               [] { ndk::load_functions("libc.so.6", "libc.so.6"); });
}

}  // namespace
