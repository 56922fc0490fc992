// Images of Android's cameras, on an Android in memory: pixels in any layout, upright; times and lenses.
#include "support/android_camera_test.h"

#include <cmath>
#include <tuple>

#include "core/clock.h"
#include "sources/android/camera2_characteristics.h"

namespace {

using AndroidPictures = AndroidCameraTest;

TEST_F(AndroidPictures, EveryLayoutOfPlanesComesAsNv12InVideoRange) {
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

// Values of an image, row by row; rotated by 90 degrees clockwise.
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

TEST_F(AndroidPictures, PicturesAreUprightOnTheDisplay) {
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

TEST_F(AndroidPictures, ImagesThatCannotBeReadAreLostAndOnlyManyOfThemLoseTheCamera) {
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

TEST_F(AndroidPictures, PlanesThatCannotBeAreNotRead) {
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

TEST_F(AndroidPictures, FramesThatTheAppHoldsKeepTheirPixelsAndStopNothing) {
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

TEST_F(AndroidPictures, TimesAreOfTheMonotonicClock) {
  constexpr int64_t kNow = 5000 * kSecond, kAsleep = 777 * kSecond;
  EXPECT_EQ(maq::camera2_time_ns(kNow - 20, std::nullopt, kNow), kNow - 20);
  EXPECT_EQ(maq::camera2_time_ns(kNow + kAsleep - 20, kNow + kAsleep, kNow), kNow - 20);
  // Impossible timestamps are replaced by the time of arrival.
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

TEST_F(AndroidPictures, IntrinsicsAreThoseOfThePicture) {
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

// Where a direction is seen in the image (OpenCV's model of a lens).
std::pair<double, double> projected(const maq_intrinsics& lens, double x, double y) {
  const double *k = lens.distortion, r2 = x * x + y * y;
  const double radial = 1 + r2 * (k[0] + r2 * (k[1] + r2 * k[4]));
  const double across = x * radial + 2 * k[2] * x * y + k[3] * (r2 + 2 * x * x);
  const double down = y * radial + k[2] * (r2 + 2 * y * y) + 2 * k[3] * x * y;
  return {lens.cx_px + lens.fx_px * across, lens.cy_px + lens.fy_px * down};
}

TEST_F(AndroidPictures, IntrinsicsRotateWithThePicture) {
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

}  // namespace
