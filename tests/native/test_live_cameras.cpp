// The V4L2 backend and the live source above it, on a driver in memory.
#include <gtest/gtest.h>

#include <chrono>
#include <opencv2/imgcodecs.hpp>
#include <thread>

#include "expect_error.h"
#include "fake_v4l2.h"
#include "sources/live_source.h"
#include "sources/v4l2_camera.h"

namespace {

using namespace std::chrono_literals;
using maq::NextFrame;
constexpr int64_t kSecond = 1000000000;

// What was reported, in order.
class Reports {
 public:
  static void note(void* self, maq_source_state state, const char*) {
    auto* reports = static_cast<Reports*>(self);
    std::lock_guard<std::mutex> lock(reports->mutex_);
    reports->states_.push_back(state);
  }
  std::vector<maq_source_state> states() const {
    std::lock_guard<std::mutex> lock(mutex_);
    return states_;
  }
  bool wait_for(maq_source_state state) const {
    for (int i = 0; i < 500; ++i) {
      const auto all = states();
      if (std::find(all.begin(), all.end(), state) != all.end()) return true;
      std::this_thread::sleep_for(10ms);
    }
    return false;
  }

 private:
  mutable std::mutex mutex_;
  std::vector<maq_source_state> states_;
};

class LiveCameras : public ::testing::Test {
 protected:
  std::shared_ptr<maq::Camera> camera(const maq::CameraWish& wish = {}) {
    return maq::open_v4l2_camera(fake_, "/dev/video0", wish, 4);
  }
  maq::SourceSettings settings() {
    maq::SourceSettings settings;
    settings.on_state = Reports::note;
    settings.user_data = &reports_;
    return settings;
  }
  std::unique_ptr<maq::LiveSource> source(const maq::SourceSettings& settings, const maq::CameraWish& wish = {}) {
    const auto open = [this, wish] { return maq::open_v4l2_camera(fake_, "/dev/video0", wish, 6); };
    return std::make_unique<maq::LiveSource>(open, "/dev/video0", settings);
  }
  void TearDown() override { wait_until_closed(fake_); }

  // On a busy machine a source's thread may need longer to end than its source waits.
  static void wait_until_closed(const FakeV4l2& fake) {
    for (int i = 0; i < 500 && fake.mappings() > 0; ++i) std::this_thread::sleep_for(10ms);
    EXPECT_EQ(fake.open_files(), 0);
    EXPECT_EQ(fake.mappings(), 0);
  }
  void expect_nothing_left() {
    EXPECT_EQ(fake_.open_files(), 0);
    EXPECT_EQ(fake_.mappings(), 0);
  }

  FakeV4l2 fake_;
  Reports reports_;
};

TEST_F(LiveCameras, TakeTheNearestOfWhatIsOffered) {
  fake_.modes = {{V4L2_PIX_FMT_YUYV, 1280, 720, 10},
                 {V4L2_PIX_FMT_YUYV, 640, 480, 30},
                 {V4L2_PIX_FMT_MJPEG, 1280, 720, 30},
                 {v4l2_fourcc('X', 'Y', 'Z', '1'), 640, 480, 60}};
  EXPECT_EQ(camera()->format().width_px, 640);
  EXPECT_EQ(camera()->format().pixels, MAQ_PIXEL_YUYV);
  EXPECT_TRUE(camera({"", 1280, 720, 30})->format().jpeg) << "at that size only JPEG is fast enough";
  EXPECT_FALSE(camera({"", 1280, 720, 10})->format().jpeg) << "slow is enough: no decoding";
  EXPECT_TRUE(camera({"MJPG", 640, 480, 30})->format().jpeg) << "asked for by name";
  expect_error(MAQ_ERROR_UNSUPPORTED, "offers YUYV, MJPG, XYZ1, but not NV12", [&] { camera({"NV12", 640, 480, 30}); });
  EXPECT_EQ(camera({"", 700, 500, 30})->format().width_px, 640);
  EXPECT_NEAR(camera({"", 640, 480, 12.5})->format().fps, 12.5, 1e-3);
}

TEST_F(LiveCameras, AreListedWithWhatTheyOfferOrWhyTheyCannotBeOpened) {
  fake_.modes.push_back({v4l2_fourcc('X', 'Y', 'Z', '1'), 100, 80, 60});
  auto found = maq::list_v4l2_cameras(fake_);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].uri, "v4l2:/dev/video0");
  EXPECT_EQ(found[0].name, "A camera in memory");
  EXPECT_EQ(found[0].bus, "memory");
  EXPECT_EQ(found[0].status, MAQ_OK);
  ASSERT_EQ(found[0].modes.size(), 3u);
  EXPECT_EQ(found[0].modes[1].format, "YUYV");
  EXPECT_EQ(found[0].modes[1].width_px, 320);
  EXPECT_EQ(found[0].modes[1].fps, 30);
  EXPECT_TRUE(found[0].modes[1].usable);
  EXPECT_FALSE(found[0].modes[2].usable);
  fake_.break_call(FakeV4l2::kOpen, EACCES);
  found = maq::list_v4l2_cameras(fake_);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].status, MAQ_ERROR_NO_PERMISSION);
  EXPECT_NE(found[0].problem.find("group"), std::string::npos);
  fake_.mend();
  fake_.capabilities = V4L2_CAP_STREAMING | V4L2_CAP_VIDEO_OUTPUT;
  EXPECT_TRUE(maq::list_v4l2_cameras(fake_).empty()) << "an output is no camera";
  fake_.unplug();
  EXPECT_TRUE(maq::list_v4l2_cameras(fake_).empty());
}

TEST_F(LiveCameras, FramesComeWithPixelsTimeAndNumber) {
  for (const bool planar : {false, true}) {
    for (const auto& [fourcc, pixels] :
         {std::pair(V4L2_PIX_FMT_YUYV, MAQ_PIXEL_YUYV), std::pair(V4L2_PIX_FMT_NV12, MAQ_PIXEL_NV12),
          std::pair(V4L2_PIX_FMT_RGB24, MAQ_PIXEL_RGB8), std::pair(V4L2_PIX_FMT_BGR24, MAQ_PIXEL_BGR8),
          std::pair(V4L2_PIX_FMT_GREY, MAQ_PIXEL_GREY8)}) {
      fake_.planar = planar;
      wait_until_closed(fake_);  // the source of the round before
      fake_.modes = {{uint32_t(fourcc), 64, 48, 30}};
      const auto live = source(settings(), {"", 64, 48, 0});
      EXPECT_TRUE(live->info().is_live);
      ASSERT_TRUE(fake_.deliver(77));
      maq::Frame frame;
      ASSERT_EQ(live->next(5 * kSecond, frame), NextFrame::kFrame);
      EXPECT_EQ(frame.image.format, pixels);
      EXPECT_EQ(frame.image.width_px, 64);
      EXPECT_EQ(frame.image.height_px, 48);
      for (int plane = 0; plane < maq::plane_count(pixels); ++plane) {
        const size_t row = maq::row_bytes(pixels, plane, 64);
        for (int y = 0; y < maq::plane_rows(pixels, plane, 48); ++y) {
          const uint8_t* line = frame.image.planes[plane].data + size_t(y) * frame.image.planes[plane].stride_bytes;
          EXPECT_EQ(std::count(line, line + row, 77), int64_t(row));
        }
      }
      timespec now{};
      clock_gettime(CLOCK_MONOTONIC, &now);
      EXPECT_EQ(frame.clock, MAQ_CLOCK_MONOTONIC);
      EXPECT_NEAR(double(frame.timestamp_ns) / 1e9, double(now.tv_sec) + double(now.tv_nsec) / 1e9, 5);
    }
  }
}

TEST_F(LiveCameras, JpegFramesAreDecodedAndDamagedOnesSkipped) {
  fake_.modes = {{V4L2_PIX_FMT_MJPEG, 64, 48, 30}};
  std::vector<uint8_t> jpeg;
  ASSERT_TRUE(cv::imencode(".jpg", cv::Mat(48, 64, CV_8UC3, cv::Scalar(20, 120, 220)), jpeg));
  maq::SourceSettings ordered = settings();
  ordered.queue_length = 4;
  const auto live = source(ordered, {"", 64, 48, 0});
  const std::vector<uint8_t> cut(jpeg.begin(), jpeg.begin() + std::ptrdiff_t(jpeg.size() / 2));
  for (const auto& bytes : {cut, std::vector<uint8_t>{1, 2, 3}, jpeg}) ASSERT_TRUE(fake_.deliver(bytes));
  maq::Frame frame;
  ASSERT_EQ(live->next(5 * kSecond, frame), NextFrame::kFrame);
  EXPECT_EQ(frame.sequence, 2u);
  EXPECT_EQ(frame.image.format, MAQ_PIXEL_BGR8);
  EXPECT_NEAR(frame.storage[0], 20, 4);
  EXPECT_NEAR(frame.storage[2], 220, 4);
  EXPECT_EQ(live->drops(), 2u);
}

TEST_F(LiveCameras, TheNewestWinsUnlessAQueueIsAskedFor) {
  for (const int queue : {1, 3}) {
    maq::SourceSettings asked = settings();
    asked.queue_length = queue;
    const auto live = source(asked);
    for (uint8_t i = 0; i < 5; ++i) {
      ASSERT_TRUE(fake_.deliver(uint8_t(100 + i)));
      std::this_thread::sleep_for(20ms);  // the thread takes it
    }
    for (int i = 5 - queue; i < 5; ++i) {
      maq::Frame frame;
      ASSERT_EQ(live->next(5 * kSecond, frame), NextFrame::kFrame);
      EXPECT_EQ(frame.image.planes[0].data[0], 100 + i);
      EXPECT_EQ(frame.sequence, uint64_t(i));
    }
    EXPECT_EQ(live->drops(), uint64_t(5 - queue));
    maq::Frame frame;
    EXPECT_EQ(live->next(0, frame), NextFrame::kTimeout);
    EXPECT_EQ(live->next(kSecond / 100, frame), NextFrame::kTimeout);
  }
}

TEST_F(LiveCameras, BuffersGoBackToTheDeviceAndHeldOnesOutliveIt) {
  auto live = source(settings());
  maq::Frame frame;
  for (int i = 0; i < 50; ++i) {
    ASSERT_TRUE(fake_.deliver(uint8_t(i))) << "frame " << i << ": all buffers are held by somebody";
    ASSERT_EQ(live->next(5 * kSecond, frame), NextFrame::kFrame);
    EXPECT_EQ(frame.image.planes[0].data[0], uint8_t(i));
    frame.lease.reset();
  }
  ASSERT_TRUE(fake_.deliver(99));
  ASSERT_EQ(live->next(5 * kSecond, frame), NextFrame::kFrame);
  EXPECT_EQ(fake_.queued(), 5u);
  live.reset();
  for (int i = 0; i < 500 && fake_.open_files() > 0; ++i) std::this_thread::sleep_for(10ms);
  EXPECT_EQ(frame.image.planes[0].data[100], 99) << "readable although the camera is closed";
  frame.lease.reset();
}

TEST_F(LiveCameras, FramesThatTheDriverCallsDamagedOrShortAreDropped) {
  const auto live = source(settings());
  ASSERT_TRUE(fake_.deliver(1, V4L2_BUF_FLAG_ERROR));
  ASSERT_TRUE(fake_.deliver(2, 0, 1000));
  ASSERT_TRUE(fake_.deliver(3));
  maq::Frame frame;
  ASSERT_EQ(live->next(5 * kSecond, frame), NextFrame::kFrame);
  EXPECT_EQ(frame.image.planes[0].data[0], 3);
  EXPECT_EQ(live->drops(), 2u);
}

TEST_F(LiveCameras, ALostCameraIsReportedAndComesBackWithNumbersThatGoOn) {
  const auto live = source(settings());
  ASSERT_TRUE(fake_.deliver(1));
  maq::Frame frame;
  ASSERT_EQ(live->next(5 * kSecond, frame), NextFrame::kFrame);
  const auto before = std::chrono::steady_clock::now();
  fake_.unplug();
  ASSERT_TRUE(reports_.wait_for(MAQ_SOURCE_LOST));
  EXPECT_LT(std::chrono::steady_clock::now() - before, 1s);
  ASSERT_TRUE(reports_.wait_for(MAQ_SOURCE_RECONNECTING));
  EXPECT_EQ(live->next(0, frame), NextFrame::kTimeout);
  fake_.plug();
  ASSERT_TRUE(reports_.wait_for(MAQ_SOURCE_BACK));
  ASSERT_TRUE(fake_.deliver(2));
  ASSERT_EQ(live->next(5 * kSecond, frame), NextFrame::kFrame);
  EXPECT_EQ(frame.image.planes[0].data[0], 2);
  EXPECT_EQ(frame.sequence, 1u);
  EXPECT_EQ(reports_.states(), (std::vector<maq_source_state>{MAQ_SOURCE_STARTED, MAQ_SOURCE_LOST,
                                                              MAQ_SOURCE_RECONNECTING, MAQ_SOURCE_BACK}));
  EXPECT_EQ(fake_.opened(), 2);
}

TEST_F(LiveCameras, ACameraThatComesBackUnderAnotherNumberIsFound) {
  const auto live =
      std::make_unique<maq::LiveSource>(maq::v4l2_opener(fake_, "/dev/video0", {}, 6), "/dev/video0", settings());
  ASSERT_TRUE(fake_.deliver(1));
  maq::Frame held;
  ASSERT_EQ(live->next(5 * kSecond, held), NextFrame::kFrame);
  fake_.unplug();
  ASSERT_TRUE(reports_.wait_for(MAQ_SOURCE_RECONNECTING));
  fake_.plug("/dev/video3");
  ASSERT_TRUE(reports_.wait_for(MAQ_SOURCE_BACK));
  ASSERT_TRUE(fake_.deliver(2));
  maq::Frame frame;
  ASSERT_EQ(live->next(5 * kSecond, frame), NextFrame::kFrame);
  EXPECT_EQ(frame.image.planes[0].data[0], 2);
  EXPECT_EQ(held.image.planes[0].data[0], 1);
}

TEST_F(LiveCameras, ACameraThatStaysAwayIsAnError) {
  maq::SourceSettings impatient = settings();
  impatient.reconnect_ms = 200;
  const auto live = source(impatient);
  ASSERT_TRUE(fake_.deliver(1));
  std::this_thread::sleep_for(50ms);
  fake_.unplug();
  ASSERT_TRUE(reports_.wait_for(MAQ_SOURCE_LOST));
  EXPECT_EQ(fake_.mappings(), 0) << "nobody holds a frame, so that the device can be had under its old number";
  maq::Frame frame;
  expect_error(MAQ_ERROR_DEVICE_LOST, "/dev/video0 was lost and did not come back within 200 ms",
               [&] { live->next(-1, frame); });
  expect_error(MAQ_ERROR_DEVICE_LOST, "was lost", [&] { live->next(0, frame); });
}

TEST_F(LiveCameras, AStallIsReportedOnceAndSoIsItsEnd) {
  maq::SourceSettings strict = settings();
  strict.stall_ms = 50;
  const auto live = source(strict);
  ASSERT_TRUE(reports_.wait_for(MAQ_SOURCE_STALLED));
  std::this_thread::sleep_for(500ms);
  ASSERT_TRUE(fake_.deliver(1));
  ASSERT_TRUE(reports_.wait_for(MAQ_SOURCE_BACK));
  EXPECT_EQ(reports_.states(),
            (std::vector<maq_source_state>{MAQ_SOURCE_STARTED, MAQ_SOURCE_STALLED, MAQ_SOURCE_BACK}));
}

TEST_F(LiveCameras, ACallbackThatThrowsEndsTheSourceAndNotTheApp) {
  maq::SourceSettings broken = settings();
  broken.on_state = [](void*, maq_source_state, const char*) { throw 5; };
  const auto live = source(broken);
  maq::Frame frame;
  expect_error(MAQ_ERROR_DEVICE_LOST, "callback threw", [&] { live->next(5 * kSecond, frame); });
}

// A device that does not answer any more.
class HangingV4l2 : public FakeV4l2 {
 public:
  int poll(pollfd* fds, nfds_t count, int timeout_ms) override {
    std::unique_lock<std::mutex> lock(hang_);
    return FakeV4l2::poll(fds, count, timeout_ms);
  }
  std::mutex hang_;
};

TEST_F(LiveCameras, ClosingDoesNotWaitForADeviceThatHangs) {
  HangingV4l2 device;
  auto live = std::make_unique<maq::LiveSource>([&] { return maq::open_v4l2_camera(device, "/dev/video0", {}, 4); },
                                                "/dev/video0", maq::SourceSettings());
  {
    std::unique_lock<std::mutex> hang(device.hang_);
    std::this_thread::sleep_for(100ms);  // until the thread is in the call that hangs
    const auto before = std::chrono::steady_clock::now();
    live.reset();
    EXPECT_LT(std::chrono::steady_clock::now() - before, 500ms);
    EXPECT_EQ(device.open_files(), 1);
  }
  for (int i = 0; i < 500 && device.mappings() > 0; ++i) std::this_thread::sleep_for(10ms);
  EXPECT_EQ(device.open_files(), 0) << "the thread closes the device when it answers";
  EXPECT_EQ(device.mappings(), 0);
}

struct Failing {
  const char* name;
  unsigned long call;
  std::vector<int> errors;
  // Without these a camera works all the same.
  bool harmless = false;
};

// The errors that the kernel's documentation names for each call, and those that any call may give.
const Failing kMatrix[] = {
    {"open", FakeV4l2::kOpen, {ENOENT, EACCES, EPERM, EBUSY, ENXIO, ENODEV, ENOMEM, EMFILE, ENFILE, EINVAL}},
    {"QUERYCAP", VIDIOC_QUERYCAP, {EINVAL, ENOTTY, ENODEV, EIO}},
    {"ENUM_FMT", VIDIOC_ENUM_FMT, {EINVAL, ENODATA, ENODEV}},
    {"TRY_FMT", VIDIOC_TRY_FMT, {EINVAL, EBADR, EBUSY, ENODEV}},
    {"ENUM_FRAMEINTERVALS", VIDIOC_ENUM_FRAMEINTERVALS, {EINVAL, ENOTTY, ENODATA}, true},
    {"S_FMT", VIDIOC_S_FMT, {EINVAL, EBADR, EBUSY, ENODEV, EIO}},
    {"G_PARM", VIDIOC_G_PARM, {EINVAL, ENOTTY}, true},
    {"REQBUFS", VIDIOC_REQBUFS, {EINVAL, EBUSY, ENOMEM, ENODEV}},
    {"QUERYBUF", VIDIOC_QUERYBUF, {EINVAL, ENODEV}},
    {"mmap", FakeV4l2::kMmap, {EACCES, EAGAIN, EINVAL, ENODEV, ENOMEM}},
    {"QBUF", VIDIOC_QBUF, {EINVAL, EIO, ENODEV, ENOMEM}},
    {"STREAMON", VIDIOC_STREAMON, {EINVAL, EPIPE, ENOLINK, ENOSPC, EIO, ENODEV}},
};

TEST_F(LiveCameras, EveryFailureOfStartingIsNamedAndLeavesNothingOpen) {
  for (const Failing& failing : kMatrix) {
    for (const int error : failing.errors) {
      for (const bool planar : {false, true}) {
        for (const int after : {0, 1, 2, 3}) {
          fake_.planar = planar;
          fake_.break_call(failing.call, error, after);
          const std::string what =
              std::string(failing.name) + " " + std::strerror(error) + " after " + std::to_string(after);
          try {
            const auto opened = camera();
            EXPECT_TRUE(failing.harmless || after > 0) << what;
          } catch (const maq::Error& failure) {
            EXPECT_FALSE(failing.harmless) << what;
            EXPECT_NE(failure.status(), MAQ_ERROR_INTERNAL) << what;
            EXPECT_EQ(std::string(failure.what()).rfind("/dev/video0 ", 0), 0u) << failure.what();
          }
          expect_nothing_left();
        }
      }
    }
  }
}

TEST_F(LiveCameras, FailuresSayWhatToDo) {
  const std::tuple<unsigned long, int, maq_status, const char*> expected[] = {
      {FakeV4l2::kOpen, EACCES, MAQ_ERROR_NO_PERMISSION, "group \"video\""},
      {FakeV4l2::kOpen, ENOENT, MAQ_ERROR_NOT_FOUND, "plugged in"},
      {VIDIOC_S_FMT, EBUSY, MAQ_ERROR_BUSY, "Another program"},
      {VIDIOC_STREAMON, ENOSPC, MAQ_ERROR_BUSY, "smaller size or rate"},
      {VIDIOC_QUERYCAP, ENOTTY, MAQ_ERROR_UNSUPPORTED, "is not a video device"},
      {VIDIOC_STREAMON, ENODEV, MAQ_ERROR_DEVICE_LOST, "plug it in again"}};
  for (const auto& [call, error, status, text] : expected) {
    fake_.break_call(call, error);
    expect_error(status, text, [&] { camera(); });
  }
  fake_.mend();
  fake_.capabilities = V4L2_CAP_STREAMING | V4L2_CAP_VIDEO_OUTPUT;
  expect_error(MAQ_ERROR_UNSUPPORTED, "captures no pictures", [&] { camera(); });
  fake_.capabilities = V4L2_CAP_VIDEO_CAPTURE;
  expect_error(MAQ_ERROR_UNSUPPORTED, "cannot stream", [&] { camera(); });
  fake_.capabilities |= V4L2_CAP_STREAMING;
  fake_.modes = {{v4l2_fourcc('X', 'Y', 'Z', '1'), 640, 480, 30}};
  expect_error(MAQ_ERROR_UNSUPPORTED, "offers XYZ1, but none of them is understood", [&] { camera(); });
}

TEST_F(LiveCameras, ADriverThatAnswersNonsenseIsRefused) {
  const std::pair<const char*, std::function<void(FakeV4l2&)>> broken[] = {
      {"lines of", [](FakeV4l2& fake) { fake.stride_bytes = 7; }},
      {"lines of", [](FakeV4l2& fake) { fake.stride_bytes = 1 << 20; }},
      {"gives 1 buffers", [](FakeV4l2& fake) { fake.granted_buffers = 1; }},
      {"buffers of 100 bytes", [](FakeV4l2& fake) { fake.buffer_bytes = 100; }},
      {"cannot be used (100000 x 2)", [](FakeV4l2& fake) {
         fake.modes = {{V4L2_PIX_FMT_GREY, 100000, 2, 30}};
       }}};
  for (const auto& [text, harm] : broken) {
    FakeV4l2 fake;
    harm(fake);
    expect_error(MAQ_ERROR_UNSUPPORTED, text, [&] { maq::open_v4l2_camera(fake, "/dev/video0", {}, 4); });
    EXPECT_EQ(fake.open_files(), 0);
    EXPECT_EQ(fake.mappings(), 0);
  }
}

TEST_F(LiveCameras, EveryFailureOfStreamingLosesTheCameraAndBringsItBack) {
  const Failing streaming[] = {{"DQBUF", VIDIOC_DQBUF, {EINVAL, EIO, EPIPE, ENODEV}},
                               {"poll", FakeV4l2::kPoll, {ENOMEM, EINVAL, EFAULT}}};
  for (const Failing& failing : streaming) {
    for (const int error : failing.errors) {
      FakeV4l2 fake;
      Reports reports;
      maq::SourceSettings asked;
      asked.on_state = Reports::note;
      asked.user_data = &reports;
      auto live = std::make_unique<maq::LiveSource>([&] { return maq::open_v4l2_camera(fake, "/dev/video0", {}, 4); },
                                                    "/dev/video0", asked);
      fake.unplug();  // no call is under way while the fault is put in
      ASSERT_TRUE(reports.wait_for(MAQ_SOURCE_RECONNECTING)) << failing.name;
      fake.break_call(failing.call, error);
      fake.plug();
      ASSERT_TRUE(reports.wait_for(MAQ_SOURCE_BACK)) << failing.name;
      fake.deliver(1);
      for (int i = 0; i < 300 && fake.opened() < 3; ++i) {
        std::this_thread::sleep_for(10ms);
        fake.deliver(1);
      }
      EXPECT_GE(fake.opened(), 3) << failing.name << " " << std::strerror(error);
      fake.mend();
      live.reset();
      wait_until_closed(fake);
    }
  }
  // Interrupted or early calls lose nothing.
  fake_.break_call(VIDIOC_DQBUF, EAGAIN);
  const auto live = source(settings());
  fake_.deliver(1);
  std::this_thread::sleep_for(50ms);
  EXPECT_EQ(fake_.opened(), 1);
}

TEST_F(LiveCameras, ABufferThatDoesNotExistLosesTheCameraButNoMemory) {
  fake_.wrong_index = 1000;
  const auto live = source(settings());
  ASSERT_TRUE(fake_.deliver(1));
  EXPECT_TRUE(reports_.wait_for(MAQ_SOURCE_LOST));
}

TEST_F(LiveCameras, AThousandTimesOpenedNothingIsLeft) {
  for (int i = 0; i < 1000; ++i) camera();
  expect_nothing_left();
  for (int i = 0; i < 20; ++i) {
    source(settings());
    wait_until_closed(fake_);
  }
}

TEST_F(LiveCameras, FramesAreTakenAndGivenBackByOtherThreadsWhileTheCameraComesAndGoes) {
  maq::SourceSettings asked = settings();
  asked.queue_length = 2;
  const auto live = source(asked);
  std::atomic<bool> done{false};
  std::thread device([&] {
    for (int i = 0; !done; ++i) {
      if (i % 100 == 50) fake_.unplug();
      if (i % 100 == 80) fake_.plug();
      fake_.deliver(uint8_t(i));
      std::this_thread::sleep_for(1ms);
    }
  });
  uint64_t last = 0;
  int taken = 0;
  for (; taken < 200;) {
    maq::Frame frame;
    const NextFrame next = live->next(5 * kSecond, frame);
    ASSERT_EQ(next, NextFrame::kFrame);
    EXPECT_TRUE(taken == 0 || frame.sequence > last);
    last = frame.sequence;
    ++taken;
    std::thread([moved = std::move(frame)]() mutable { moved.lease.reset(); }).join();
  }
  done = true;
  device.join();
}

}  // namespace
