// Every failure of a driver: each system call with each of its errors, devices that vanish, answers that cannot be.
#include <gtest/gtest.h>
#include <malloc.h>

#include <climits>
#include <filesystem>
#include <functional>
#include <opencv2/imgcodecs.hpp>
#include <tuple>

#include "support/live_camera_test.h"

namespace {

class V4l2Faults : public LiveCameraTest {};

struct Failing {
  const char* name;
  unsigned long call;
  std::vector<int> errors;
  // Without these a camera works all the same.
  bool harmless = false;
};

// The errors that the kernel's documentation names for each call, and those that any call may give.
const Failing kStarting[] = {
    {"open", FakeV4l2::kOpen, {ENOENT, EACCES, EPERM, EBUSY, ENXIO, ENODEV, ENOMEM, EMFILE, ENFILE, EINVAL}},
    {"QUERYCAP", VIDIOC_QUERYCAP, {EINVAL, ENOTTY, ENODEV, EIO}},
    {"ENUM_FMT", VIDIOC_ENUM_FMT, {EINVAL, ENODATA, ENODEV}},
    {"TRY_FMT", VIDIOC_TRY_FMT, {EINVAL, EBADR, EBUSY, ENODEV}},
    {"ENUM_FRAMEINTERVALS", VIDIOC_ENUM_FRAMEINTERVALS, {EINVAL, ENOTTY, ENODATA}, true},
    {"S_FMT", VIDIOC_S_FMT, {EINVAL, EBADR, EBUSY, ENODEV, EIO}},
    {"G_PARM", VIDIOC_G_PARM, {EINVAL, ENOTTY}, true},
    {"S_PARM", VIDIOC_S_PARM, {EINVAL, ENOTTY, EBUSY, EIO}, true},
    {"REQBUFS", VIDIOC_REQBUFS, {EINVAL, EBUSY, ENOMEM, ENODEV}},
    {"QUERYBUF", VIDIOC_QUERYBUF, {EINVAL, ENODEV}},
    {"mmap", FakeV4l2::kMmap, {EACCES, EAGAIN, EINVAL, ENODEV, ENOMEM}},
    {"QBUF", VIDIOC_QBUF, {EINVAL, EIO, ENODEV, ENOMEM}},
    {"STREAMON", VIDIOC_STREAMON, {EINVAL, EPIPE, ENOLINK, ENOSPC, EIO, ENODEV}},
};

TEST_F(V4l2Faults, EveryFailureOfStartingIsNamedAndLeavesNothingOpen) {
  for (const uint32_t fourcc : {V4L2_PIX_FMT_YUYV, V4L2_PIX_FMT_NV12M}) {
    fake_.planar = fourcc == V4L2_PIX_FMT_NV12M;
    fake_.modes = {{fourcc, 64, 48, 30}, {fourcc, 32, 24, 30}};
    for (const Failing& failing : kStarting) {
      for (const int error : failing.errors) {
        for (const int after : {0, 1, 2, 3}) {
          fake_.break_call(failing.call, error, after);
          const std::string what =
              std::string(failing.name) + " " + std::strerror(error) + " after " + std::to_string(after);
          try {
            const auto opened = camera({"", 0, 0, 15});
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

TEST_F(V4l2Faults, SayWhatToDo) {
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
  expect_error(MAQ_ERROR_UNSUPPORTED, "captures no images", [&] { camera(); });
  fake_.capabilities = V4L2_CAP_VIDEO_CAPTURE;
  expect_error(MAQ_ERROR_UNSUPPORTED, "cannot stream", [&] { camera(); });
  fake_.capabilities |= V4L2_CAP_STREAMING;
  fake_.modes = {{v4l2_fourcc('X', 'Y', 'Z', '1'), 640, 480, 30}};
  expect_error(MAQ_ERROR_UNSUPPORTED, "offers XYZ1, but none of them is understood", [&] { camera(); });
}

TEST_F(V4l2Faults, OfListingLeaveTheCameraInTheList) {
  for (const unsigned long call : {VIDIOC_ENUM_FMT, VIDIOC_ENUM_FRAMESIZES, VIDIOC_ENUM_FRAMEINTERVALS}) {
    for (const int error : {EINVAL, ENOTTY, ENODATA, EIO, ENODEV}) {
      fake_.break_call(call, error);
      const auto found = maq::list_v4l2_cameras(fake_);
      ASSERT_EQ(found.size(), 1u) << call << " " << std::strerror(error);
      EXPECT_EQ(found[0].name, "A camera in memory");
      EXPECT_EQ(found[0].modes.size(), call == VIDIOC_ENUM_FRAMEINTERVALS ? 2u : 0u);
      EXPECT_EQ(found[0].status != MAQ_OK, !found[0].problem.empty());
      expect_nothing_left();
    }
  }
}

TEST_F(V4l2Faults, InterruptedCallsAreMadeAgain) {
  for (const Failing& failing : kStarting) {
    if (failing.call == FakeV4l2::kMmap) continue;  // is never interrupted
    fake_.break_call(failing.call, EINTR, 0, 3);
    EXPECT_NO_THROW(camera({"", 0, 0, 15})) << failing.name;
  }
  const auto live = source(settings());
  for (const unsigned long call : {VIDIOC_DQBUF, VIDIOC_QBUF, FakeV4l2::kPoll}) {
    fake_.break_call(call, EINTR, 0, 3);
    for (int i = 0; i < 20; ++i) {
      ASSERT_TRUE(fake_.deliver(1));
      next(*live);
    }
  }
  EXPECT_EQ(reports_.states(), std::vector<maq_source_state>{MAQ_SOURCE_STARTED});
}

TEST_F(V4l2Faults, ADriverThatIsInterruptedOrListsForEverDoesNotHoldAnybody) {
  fake_.break_call(VIDIOC_S_FMT, EINTR);
  expect_error(MAQ_ERROR_UNSUPPORTED, "does not take its own format", [&] { camera(); });
  fake_.mend();
  fake_.endless = true;
  EXPECT_LE(maq::list_v4l2_cameras(fake_).at(0).modes.size(), 256u);
  EXPECT_EQ(camera()->format().width_px, 640);
}

TEST_F(V4l2Faults, AnswersThatCannotBeAreRefused) {
  const std::pair<const char*, std::function<void(FakeV4l2&)>> broken[] = {
      {"lines of", [](FakeV4l2& fake) { fake.stride_bytes = 7; }},
      {"lines of", [](FakeV4l2& fake) { fake.stride_bytes = 1 << 20; }},
      {"gives 1 buffers", [](FakeV4l2& fake) { fake.granted_buffers = 1; }},
      {"gives 4000000000 buffers", [](FakeV4l2& fake) { fake.granted_buffers = 4000000000; }},
      {"buffers of 100 bytes", [](FakeV4l2& fake) { fake.buffer_bytes = 100; }},
      {"none of them is understood",
       [](FakeV4l2& fake) {
         fake.planar = true;
         fake.wrong_planes = 7;
       }},
      {"none of them is understood",
       [](FakeV4l2& fake) {
         fake.modes = {{V4L2_PIX_FMT_NV12M, 640, 480, 30}};
       }},
      {"cannot be used (100000 x 2)",
       [](FakeV4l2& fake) {
         fake.modes = {{V4L2_PIX_FMT_GREY, 100000, 2, 30}};
       }},
      {"cannot be used (-5 x 2)", [](FakeV4l2& fake) {
         fake.modes = {{V4L2_PIX_FMT_GREY, -5, 2, 30}};
       }}};
  for (const auto& [text, harm] : broken) {
    FakeV4l2 fake;
    harm(fake);
    expect_error(MAQ_ERROR_UNSUPPORTED, text, [&] { maq::open_v4l2_camera(fake, "/dev/video0", {}, 4); });
    EXPECT_EQ(fake.open_files(), 0);
    EXPECT_EQ(fake.mappings(), 0);
  }
}

TEST_F(V4l2Faults, MoreBuffersThanAskedForAreAllUsed) {
  fake_.granted_buffers = 32;
  const auto live = source(settings());
  EXPECT_EQ(fake_.queued(), 32u);
  for (int i = 0; i < 100; ++i) {
    ASSERT_TRUE(fake_.deliver(uint8_t(i)));
    EXPECT_EQ(next(*live).image.planes[0].data[0], uint8_t(i));
  }
}

TEST_F(V4l2Faults, OfStreamingLoseTheCameraAndBringItBack) {
  constexpr int kBuffers = 4;
  const struct {
    Failing failing;
    int after;  // calls that starting makes
  } table[] = {{{"DQBUF", VIDIOC_DQBUF, {EINVAL, EIO, EPIPE, ENOMEM, ENODEV}}, 0},
               {{"QBUF", VIDIOC_QBUF, {EINVAL, EIO, ENOMEM, ENODEV}}, kBuffers},
               {{"poll", FakeV4l2::kPoll, {ENOMEM, EINVAL, EFAULT}}, 0}};
  for (const auto& [failing, after] : table) {
    for (const int error : failing.errors) {
      FakeV4l2 fake;
      Reports reports;
      maq::SourceSettings asked;
      asked.on_state = Reports::note;
      asked.user_data = &reports;
      auto live = std::make_unique<maq::LiveSource>(
          [&] { return maq::open_v4l2_camera(fake, "/dev/video0", {}, kBuffers); }, "/dev/video0", asked);
      fake.unplug();  // no call is under way while the fault is put in
      ASSERT_TRUE(reports.wait_for(MAQ_SOURCE_RECONNECTING)) << failing.name;
      fake.break_call(failing.call, error, after, 1);
      fake.plug();
      ASSERT_TRUE(reports.wait_for(MAQ_SOURCE_RECONNECTED)) << failing.name;
      EXPECT_TRUE(wait_until([&] {
        fake.deliver(1);
        return fake.opened() >= 3;
      })) << failing.name
          << " " << std::strerror(error);
      fake.mend();
      live.reset();
      wait_until_closed(fake);
    }
  }
}

TEST_F(V4l2Faults, AnErrorOfPollAloneLosesTheCamera) {
  const auto live = source(settings());
  fake_.raise_poll_error(true);
  ASSERT_TRUE(reports_.wait_for(MAQ_SOURCE_RECONNECTING));
  fake_.raise_poll_error(false);
  EXPECT_TRUE(reports_.wait_for(MAQ_SOURCE_RECONNECTED));
}

TEST_F(V4l2Faults, FramesThatAreNotReadyAreWaitedFor) {
  const auto live = source(settings());
  fake_.break_call(VIDIOC_DQBUF, EAGAIN, 0, 1);
  ASSERT_TRUE(fake_.deliver(1));
  next(*live);
  EXPECT_EQ(fake_.opened(), 1);
}

TEST_F(V4l2Faults, AStreamThatCannotBeStoppedIsClosed) {
  for (const int error : {EINVAL, EIO, ENODEV}) {
    auto live = source(settings());
    fake_.break_call(VIDIOC_STREAMOFF, error);
    live.reset();
    wait_until_closed(fake_);
    fake_.mend();
  }
}

TEST_F(V4l2Faults, ADeviceThatVanishesAtAnyCallOfStartingIsLost) {
  for (const Failing& failing : kStarting) {
    for (const int after : {0, 1, 2, 3}) {
      fake_.vanish_at(failing.call, after);
      // mmap is not a call to the device: the loss is noticed with the next one.
      try {
        camera({"", 0, 0, 15});
      } catch (const maq::Error& failure) {
        EXPECT_EQ(failure.status(), failing.call == FakeV4l2::kOpen ? MAQ_ERROR_NOT_FOUND : MAQ_ERROR_DEVICE_LOST)
            << failing.name << ": " << failure.what();
      }
      expect_nothing_left();
      fake_.mend();
      fake_.plug();
    }
  }
}

TEST_F(V4l2Faults, ADeviceThatVanishesAtAnyCallOfStreamingComesBack) {
  for (const unsigned long call : {FakeV4l2::kPoll, VIDIOC_DQBUF, VIDIOC_QBUF}) {
    Reports reports;
    maq::SourceSettings asked = settings();
    asked.user_data = &reports;
    auto live = source(asked);
    fake_.vanish_at(call);
    for (int i = 0; i < 3; ++i) {
      fake_.deliver(1);
      std::this_thread::sleep_for(20ms);
    }
    ASSERT_TRUE(reports.wait_for(MAQ_SOURCE_RECONNECTING)) << call;
    fake_.plug();
    ASSERT_TRUE(reports.wait_for(MAQ_SOURCE_RECONNECTED)) << call;
    ASSERT_TRUE(fake_.deliver(2));
    EXPECT_EQ(next(*live).image.planes[0].data[0], 2);
    fake_.vanish_at(VIDIOC_STREAMOFF);
    live.reset();
    wait_until_closed(fake_);
    fake_.mend();
    fake_.plug();
  }
}

TEST_F(V4l2Faults, ABufferThatDoesNotExistOrIsHeldLosesTheCameraButNoMemory) {
  for (const uint32_t wrong : {1000u, UINT32_MAX}) {  // buffer 1000, and that of the frame before
    Reports reports;
    maq::SourceSettings asked = settings();
    asked.user_data = &reports;
    auto live = source(asked);
    ASSERT_TRUE(fake_.deliver(1));
    const maq::Frame held = next(*live);
    fake_.add_to_index(wrong);
    ASSERT_TRUE(fake_.deliver(2));
    EXPECT_TRUE(reports.wait_for(MAQ_SOURCE_LOST)) << wrong;
    EXPECT_EQ(held.image.planes[0].data[0], 1);
    fake_.add_to_index(0);
    live.reset();
  }
}

TEST_F(V4l2Faults, TimesThatRepeatOrGoBackAreDroppedAndCounted) {
  maq::SourceSettings ordered = settings();
  ordered.queue_length = 8;
  const auto live = source(ordered);
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  const auto deliver_at = [&](int us, uint8_t value) {
    fake_.stamp_frames(timeval{now.tv_sec - 1, us});
    ASSERT_TRUE(fake_.deliver(value));
  };
  deliver_at(1000, 1);
  deliver_at(1000, 2);
  deliver_at(500, 3);
  deliver_at(999, 4);
  deliver_at(1001, 5);
  const maq::Frame first = next(*live), second = next(*live);
  EXPECT_EQ(first.image.planes[0].data[0], 1);
  EXPECT_EQ(second.image.planes[0].data[0], 5);
  EXPECT_EQ(second.timestamp_ns - first.timestamp_ns, 1000);
  EXPECT_EQ(second.sequence, 4u);
  EXPECT_EQ(live->drops(), 3u);
}

TEST_F(V4l2Faults, AFrameThatComesAfterItsSuccessorIsDroppedOnce) {
  const auto live = source(settings());
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  for (const int number : {0, 1, 3, 2, 4}) {
    fake_.number_frames_from(uint32_t(number));
    fake_.stamp_frames(timeval{now.tv_sec - 1, number * 1000});
    ASSERT_TRUE(fake_.deliver(uint8_t(number)));
    if (number == 2) continue;  // is not shown
    EXPECT_EQ(next(*live).sequence, uint64_t(number));
  }
  EXPECT_EQ(live->drops(), 1u);
}

TEST_F(V4l2Faults, TimesThatCannotBeAreThoseOfArrival) {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  const auto live = source(settings());
  int64_t last = 0;
  for (const timeval stamp :
       {timeval{now.tv_sec + 100, 0}, timeval{now.tv_sec - 11, 0}, timeval{0, 0}, timeval{-1, 0},
        timeval{LONG_MAX, LONG_MAX}, timeval{LONG_MIN, 0}, timeval{now.tv_sec, -1}, timeval{now.tv_sec - 1, 1000000}}) {
    fake_.stamp_frames(stamp);
    ASSERT_TRUE(fake_.deliver(1));
    const maq::Frame frame = next(*live);
    EXPECT_GT(frame.timestamp_ns, last);
    EXPECT_GE(frame.timestamp_ns, int64_t(now.tv_sec) * kSecond + now.tv_nsec);
    EXPECT_LT(frame.timestamp_ns, int64_t(now.tv_sec + 60) * kSecond);
    last = frame.timestamp_ns;
  }
  EXPECT_EQ(live->drops(), 0u);
}

TEST_F(V4l2Faults, NumbersThatRepeatGoBackOrLeapCountOn) {
  const auto live = source(settings());
  uint64_t expected = 0;
  for (const uint32_t number : {7u, 8u, 8u, 7u, 0u, 1u, 4000000000u, 4000000001u, 5u}) {
    fake_.number_frames_from(number);
    ASSERT_TRUE(fake_.deliver(1));
    EXPECT_EQ(next(*live).sequence, expected++) << number;
  }
  EXPECT_EQ(live->drops(), 0u);
  fake_.number_frames_from(UINT32_MAX);
  ASSERT_TRUE(fake_.deliver(1));
  EXPECT_EQ(next(*live).sequence, expected);
  fake_.number_frames_from(3);  // over the largest number
  ASSERT_TRUE(fake_.deliver(1));
  EXPECT_EQ(next(*live).sequence, expected + 4);
  EXPECT_EQ(live->drops(), 3u);
}

TEST_F(V4l2Faults, JpegImagesThatAreShortOrTooLargeAreDropped) {
  fake_.modes = {{V4L2_PIX_FMT_MJPEG, 60, 41, 30}};
  const auto encoded = [](int width, int height) {
    std::vector<uint8_t> jpeg;
    EXPECT_TRUE(cv::imencode(".jpg", cv::Mat(height, width, CV_8UC3, cv::Scalar(20, 120, 220)), jpeg));
    return jpeg;
  };
  const std::vector<uint8_t> whole = encoded(64, 48);  // the same in blocks of 16 x 16
  std::vector<uint8_t> huge = whole;                   // whose header says 16000 x 16000
  for (size_t i = 0; i + 9 < huge.size(); ++i) {
    if (huge[i] != 0xFF || huge[i + 1] != 0xC0) continue;
    for (const size_t side : {i + 5, i + 7}) {
      huge[side] = 16000 / 256;
      huge[side + 1] = 16000 % 256;
    }
    break;
  }
  std::vector<std::vector<uint8_t>> bad = {{}, {0xFF}, {0xFF, 0xD8}, encoded(64, 64), encoded(80, 48), huge};
  for (size_t size = 3; size + 3 < whole.size(); size += 61)
    bad.emplace_back(whole.begin(), whole.begin() + long(size));
  const auto live = source(settings());
  uint64_t dropped = 0;
  for (const std::vector<uint8_t>& jpeg : bad) {
    ASSERT_TRUE(fake_.deliver(jpeg));
    maq::Frame frame;
    EXPECT_EQ(live->next(kSecond / 20, frame), NextFrame::kTimeout) << jpeg.size() << " bytes";
    EXPECT_EQ(live->drops(), ++dropped);
    ASSERT_TRUE(fake_.deliver(whole));
    EXPECT_EQ(next(*live).image.width_px, 64) << "the decoder is as good as new after " << jpeg.size() << " bytes";
  }
  ASSERT_TRUE(fake_.deliver(encoded(32, 24)));
  EXPECT_EQ(next(*live).image.width_px, 32);
}

TEST_F(V4l2Faults, WithoutDmaBufsFramesComeAllTheSame) {
  const auto live = source(settings());
  for (const int error : {EINVAL, ENOTTY, ENOMEM, EMFILE, EBUSY, EIO, ENODEV}) {
    fake_.break_call(VIDIOC_EXPBUF, error);
    ASSERT_TRUE(fake_.deliver(1));
    EXPECT_EQ(next(*live).lease.dma_buf(), -1) << std::strerror(error);
  }
  EXPECT_EQ(fake_.opened(), 1);
}

TEST_F(V4l2Faults, AThousandTimesOpenedNothingIsLeft) {
  fake_.modes = {{V4L2_PIX_FMT_YUYV, 64, 48, 30}};
  const auto open_files = [] {
    const auto entries = std::filesystem::directory_iterator("/proc/self/fd");
    return std::distance(begin(entries), end(entries));
  };
  const auto open_and_close = [&] {
    const auto opened = camera();
    ASSERT_TRUE(fake_.deliver(1));
    maq::CameraBuffer buffer;
    std::string reason;
    ASSERT_EQ(opened->wait(-1, 1000, buffer, reason), maq::Camera::Event::kFrame);
    EXPECT_GE(opened->dma_buf(buffer.slot), 0);
  };
  open_and_close();
  const auto files_before = open_files();
  const size_t bytes_before = mallinfo2().uordblks;
  for (int i = 0; i < 1000; ++i) open_and_close();
  expect_nothing_left();
  EXPECT_EQ(open_files(), files_before);
  EXPECT_LT(mallinfo2().uordblks, bytes_before + 100000) << "a frame has 6144 bytes";
  for (int i = 0; i < 20; ++i) {
    source(settings());
    wait_until_closed(fake_);
  }
  EXPECT_EQ(open_files(), files_before);
}

}  // namespace
