// The V4L2 backend and the live source above it, on a driver in memory.
#include <fcntl.h>
#include <gtest/gtest.h>

#include <atomic>
#include <opencv2/imgcodecs.hpp>

#include "support/live_camera_test.h"

namespace {

class LiveCameras : public LiveCameraTest {};

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
  EXPECT_TRUE(maq::list_v4l2_cameras(fake_).empty()) << "an output is not a camera";
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
      ASSERT_EQ(live->next(kLimit, frame), NextFrame::kFrame);
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

TEST_F(LiveCameras, PlanesInMemoryOfTheirOwnAreShownWhereTheyBegin) {
  fake_.planar = true;
  fake_.modes = {{V4L2_PIX_FMT_NV12M, 64, 48, 30}};
  fake_.data_offset[0] = 128;
  fake_.data_offset[1] = 16;
  const auto live = source(settings());
  EXPECT_EQ(fake_.mappings(), 2 * 6);
  ASSERT_TRUE(fake_.deliver(1, 0, 64 * 48 - 1));  // one byte short in the first plane
  ASSERT_TRUE(fake_.deliver(77));
  const maq::Frame frame = next(*live);
  EXPECT_EQ(frame.image.format, MAQ_PIXEL_NV12);
  EXPECT_EQ(frame.image.planes[0].stride_bytes, 64u);
  EXPECT_EQ(frame.image.planes[1].stride_bytes, 96u);
  for (int plane = 0; plane < 2; ++plane) {
    const maq::PlaneView& view = frame.image.planes[plane];
    const size_t bytes = view.stride_bytes * (plane == 0 ? 48 : 24);
    EXPECT_EQ(std::count(view.data, view.data + bytes, 77 + plane), int64_t(bytes));
  }
  EXPECT_EQ(live->drops(), 1u);
  EXPECT_EQ(frame.lease.dma_buf(), -1) << "one file cannot hold both planes";
}

TEST_F(LiveCameras, DepthComesWhereItIsAskedFor) {
  fake_.modes = {{V4L2_PIX_FMT_Z16, 64, 48, 30}, {V4L2_PIX_FMT_YUYV, 64, 48, 30}};
  EXPECT_EQ(camera()->format().pixels, MAQ_PIXEL_YUYV) << "a picture where there is one";
  maq::CameraRequest request;
  request.format = "Z16";
  fake_.stride_bytes = 160;
  const auto live = source(settings(), request);
  fake_.deliver(4);
  const maq::Frame frame = next(*live);
  EXPECT_EQ(frame.image.format, MAQ_PIXEL_DEPTH16);
  EXPECT_EQ(frame.image.width_px, 64);
  EXPECT_EQ(frame.image.planes[0].stride_bytes, 160u);
  EXPECT_GE(frame.lease.dma_buf(), 0) << "in the device's own memory";
  EXPECT_EQ(maq::depth_of(frame), &frame.image);
  fake_.modes = {{V4L2_PIX_FMT_Z16, 64, 48, 30}};
  expect_error(MAQ_ERROR_UNSUPPORTED, "offers Z16, but all of them are depth; open depth with format=Z16",
               [&] { camera(); });
  const std::vector<maq::CameraListing> listed = maq::list_v4l2_cameras(fake_);
  ASSERT_EQ(listed.size(), 1u);
  EXPECT_EQ(listed[0].modes.at(0).format, "Z16");
  EXPECT_TRUE(listed[0].modes.at(0).usable);
}

TEST_F(LiveCameras, DepthInAnotherUnitBecomesMetresAndItsBufferGoesBackAtOnce) {
  fake_.modes = {{V4L2_PIX_FMT_Z16, 64, 48, 30}};
  fake_.stride_bytes = 160;
  maq::CameraRequest request;
  request.format = "Z16";
  request.depth_unit_m = 0.00025;
  const auto live = source(settings(), request);
  const auto first_metres = [](const maq::Frame& frame) {
    float metres = 0;
    std::memcpy(&metres, frame.image.planes[0].data, sizeof metres);
    return metres;
  };
  maq::Frame frame;
  const size_t queued = fake_.queued();
  for (const uint8_t value : {uint8_t(0), uint8_t(1), uint8_t(254), uint8_t(255)}) {
    fake_.deliver(value);
    ASSERT_EQ(live->next(kLimit, frame), NextFrame::kFrame);
    ASSERT_EQ(frame.image.format, MAQ_PIXEL_DEPTH32F);
    EXPECT_EQ(frame.image.planes[0].stride_bytes, 64u * 4);
    EXPECT_FLOAT_EQ(first_metres(frame), value == 255 ? 0 : float(257 * value) * 0.00025f) << int(value);
    EXPECT_EQ(fake_.queued(), queued);
    EXPECT_EQ(frame.lease.dma_buf(), -1);
  }
}

TEST_F(LiveCameras, TheCalibrationThatIsGivenIsThatOfTheAgreedSize) {
  EXPECT_EQ(source(settings())->intrinsics(), nullptr);
  maq::SourceUri uri = maq::parse_source_uri("v4l2:0?fov=90&cy=7");
  const maq::CalibrationOptions calibration(uri);
  maq::CameraRequest request;
  request.width_px = 300;
  request.height_px = 200;
  const auto open = [&] { return maq::open_v4l2_camera(fake_, "/dev/video0", request, 4); };
  const maq::LiveSource live(open, "/dev/video0", settings(), {}, calibration);
  ASSERT_NE(live.intrinsics(), nullptr);
  EXPECT_EQ(live.intrinsics()->width_px, 320);
  EXPECT_NEAR(live.intrinsics()->fx_px, 160, 1e-9);
  EXPECT_EQ(live.intrinsics()->cx_px, 159.5);
  EXPECT_EQ(live.intrinsics()->cy_px, 7);
}

TEST_F(LiveCameras, BytesOfAPlaneAreCountedWithoutWhatIsBeforeThem) {
  fake_.planar = true;
  const auto live = source(settings(), {"", 320, 240, 0});
  ASSERT_TRUE(fake_.deliver(1));
  EXPECT_EQ(next(*live).image.planes[0].data[0], 1);
  uint64_t dropped = 0;
  for (const uint32_t offset : {1000u, UINT32_MAX}) {  // more than its buffers have room for
    fake_.set_data_offset(offset);
    ASSERT_TRUE(fake_.deliver(2));
    ++dropped;
    wait_until([&] { return live->drops() >= dropped; });
    EXPECT_EQ(live->drops(), dropped);
  }
  fake_.set_data_offset(0);
  ASSERT_TRUE(fake_.deliver(4));
  EXPECT_EQ(next(*live).image.planes[0].data[0], 4);
  EXPECT_EQ(live->drops(), dropped);
}

TEST_F(LiveCameras, AFrameIsADmaBufMadeOnceForItsBuffer) {
  auto live = source(settings());
  int first = -1;
  for (int i = 0; i < 30; ++i) {
    ASSERT_TRUE(fake_.deliver(1));
    const maq::Frame frame = next(*live);
    const int fd = frame.lease.dma_buf();
    EXPECT_GE(fd, 0);
    EXPECT_EQ(frame.lease.dma_buf(), fd);
    if (i == 0) first = fd;
    EXPECT_EQ(fd == first, i % 6 == 0) << "six buffers, in turns";
  }
  EXPECT_EQ(fake_.exports(), 6);
  ASSERT_TRUE(fake_.deliver(1));
  maq::Frame held = next(*live);
  const int fd = held.lease.dma_buf();
  fake_.unplug();
  ASSERT_TRUE(reports_.wait_for(MAQ_SOURCE_LOST));
  EXPECT_EQ(held.lease.dma_buf(), fd);
  EXPECT_NE(fcntl(fd, F_GETFD), -1) << "still open";
  EXPECT_EQ(fake_.exported(), 6u);
  live.reset();
  EXPECT_EQ(held.lease.dma_buf(), fd);
  held.lease.reset();
  wait_until_closed(fake_);
}

TEST_F(LiveCameras, AFrameIsNoDmaBufWhereNoneCanBeMade) {
  auto live = source(settings());
  ASSERT_TRUE(fake_.deliver(1));
  maq::Frame frame = next(*live);
  fake_.unplug();
  ASSERT_TRUE(reports_.wait_for(MAQ_SOURCE_LOST));
  EXPECT_EQ(frame.lease.dma_buf(), -1) << "it is too late to make one";
  frame.lease.reset();
  live.reset();
  wait_until_closed(fake_);
  fake_.plug();
  fake_.can_export = false;
  live = source(settings());
  ASSERT_TRUE(fake_.deliver(1));
  EXPECT_EQ(next(*live).lease.dma_buf(), -1);
  live.reset();
  wait_until_closed(fake_);
  fake_.can_export = true;
  fake_.planar = true;
  fake_.data_offset[0] = 128;
  live = source(settings());
  ASSERT_TRUE(fake_.deliver(1));
  EXPECT_EQ(next(*live).lease.dma_buf(), -1) << "the app could not know where in it the picture begins";
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
  ASSERT_EQ(live->next(kLimit, frame), NextFrame::kFrame);
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
    for (uint8_t i = 0; i < 5; ++i) ASSERT_TRUE(fake_.deliver(uint8_t(100 + i)));
    ASSERT_TRUE(wait_until([&] { return live->drops() == uint64_t(5 - queue); })) << "the thread takes them all";
    for (int i = 5 - queue; i < 5; ++i) {
      maq::Frame frame;
      ASSERT_EQ(live->next(kLimit, frame), NextFrame::kFrame);
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
    ASSERT_TRUE(fake_.deliver(uint8_t(i))) << "frame " << i << ": all buffers are held";
    ASSERT_EQ(live->next(kLimit, frame), NextFrame::kFrame);
    EXPECT_EQ(frame.image.planes[0].data[0], uint8_t(i));
    frame.lease.reset();
  }
  ASSERT_TRUE(fake_.deliver(99));
  ASSERT_EQ(live->next(kLimit, frame), NextFrame::kFrame);
  EXPECT_EQ(fake_.queued(), 5u);
  live.reset();
  ASSERT_TRUE(wait_until([&] { return fake_.open_files() == 0; }));
  EXPECT_EQ(frame.image.planes[0].data[100], 99) << "readable although the camera is closed";
  frame.lease.reset();
}

TEST_F(LiveCameras, FramesThatTheDriverCallsDamagedOrShortAreDropped) {
  const auto live = source(settings());
  ASSERT_TRUE(fake_.deliver(1, V4L2_BUF_FLAG_ERROR));
  ASSERT_TRUE(fake_.deliver(2, 0, 1000));
  ASSERT_TRUE(fake_.deliver(3));
  maq::Frame frame;
  ASSERT_EQ(live->next(kLimit, frame), NextFrame::kFrame);
  EXPECT_EQ(frame.image.planes[0].data[0], 3);
  EXPECT_EQ(live->drops(), 2u);
}

TEST_F(LiveCameras, ALostCameraIsReportedAndComesBackWithNumbersThatGoOn) {
  const auto live = source(settings());
  ASSERT_TRUE(fake_.deliver(1));
  maq::Frame frame;
  ASSERT_EQ(live->next(kLimit, frame), NextFrame::kFrame);
  fake_.unplug();
  ASSERT_TRUE(reports_.wait_for(MAQ_SOURCE_LOST));
  ASSERT_TRUE(reports_.wait_for(MAQ_SOURCE_RECONNECTING));
  EXPECT_EQ(live->next(0, frame), NextFrame::kTimeout);
  fake_.plug();
  ASSERT_TRUE(reports_.wait_for(MAQ_SOURCE_RECONNECTED));
  ASSERT_TRUE(fake_.deliver(2));
  ASSERT_EQ(live->next(kLimit, frame), NextFrame::kFrame);
  EXPECT_EQ(frame.image.planes[0].data[0], 2);
  EXPECT_EQ(frame.sequence, 1u);
  EXPECT_EQ(reports_.states(), (std::vector<maq_source_state>{MAQ_SOURCE_STARTED, MAQ_SOURCE_LOST,
                                                              MAQ_SOURCE_RECONNECTING, MAQ_SOURCE_RECONNECTED}));
  EXPECT_EQ(fake_.opened(), 2);
}

TEST_F(LiveCameras, ACameraThatComesBackUnderAnotherNumberIsFound) {
  const auto live =
      std::make_unique<maq::LiveSource>(maq::v4l2_opener(fake_, "/dev/video0", {}, 6), "/dev/video0", settings());
  ASSERT_TRUE(fake_.deliver(1));
  maq::Frame held;
  ASSERT_EQ(live->next(kLimit, held), NextFrame::kFrame);
  fake_.unplug();
  ASSERT_TRUE(reports_.wait_for(MAQ_SOURCE_RECONNECTING));
  fake_.plug("/dev/video3");
  ASSERT_TRUE(reports_.wait_for(MAQ_SOURCE_RECONNECTED));
  ASSERT_TRUE(fake_.deliver(2));
  maq::Frame frame;
  ASSERT_EQ(live->next(kLimit, frame), NextFrame::kFrame);
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
  EXPECT_EQ(fake_.mappings(), 0) << "no frame is held, so that the device can come back under its old number";
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
  ASSERT_TRUE(reports_.wait_for(MAQ_SOURCE_RECONNECTED));
  // On a busy machine it may stall again by now.
  std::vector<maq_source_state> states = reports_.states();
  states.resize(3);
  EXPECT_EQ(states, (std::vector<maq_source_state>{MAQ_SOURCE_STARTED, MAQ_SOURCE_STALLED, MAQ_SOURCE_RECONNECTED}));
}

TEST_F(LiveCameras, ACallbackThatThrowsEndsTheSourceAndNotTheApp) {
  maq::SourceSettings broken = settings();
  broken.on_state = [](void*, maq_source_state, const char*) { throw 5; };
  const auto live = source(broken);
  maq::Frame frame;
  expect_error(MAQ_ERROR_DEVICE_LOST, "callback threw", [&] { live->next(kLimit, frame); });
}

// A device that does not answer any more.
class HangingV4l2 : public FakeV4l2 {
 public:
  int poll(pollfd* fds, nfds_t count, int timeout_ms) override {
    is_waiting_ = true;
    std::unique_lock<std::mutex> lock(hang_);
    is_waiting_ = false;
    return FakeV4l2::poll(fds, count, timeout_ms);
  }
  std::mutex hang_;
  std::atomic<bool> is_waiting_{false};
};

TEST_F(LiveCameras, ClosingDoesNotWaitForADeviceThatHangs) {
  HangingV4l2 device;
  auto live = std::make_unique<maq::LiveSource>([&] { return maq::open_v4l2_camera(device, "/dev/video0", {}, 4); },
                                                "/dev/video0", maq::SourceSettings());
  {
    std::unique_lock<std::mutex> hang(device.hang_);
    ASSERT_TRUE(wait_until([&] { return device.is_waiting_.load(); })) << "the thread is in the call that hangs";
    live.reset();  // would never return if it waited for the device
    EXPECT_EQ(device.open_files(), 1);
  }
  wait_until([&] { return device.mappings() == 0; });
  EXPECT_EQ(device.open_files(), 0) << "the thread closes the device when it answers";
  EXPECT_EQ(device.mappings(), 0);
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
    const NextFrame next = live->next(kLimit, frame);
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
