// Resizing against OpenCV's, to the bit.
#include "image/geometry/resize.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <opencv2/imgproc.hpp>
#include <random>

#include "support/expect_error.h"

namespace {

cv::Mat noise(int width, int height, int channels, uint64_t seed) {
  cv::Mat image(height, width, CV_8UC(channels));
  cv::RNG random(seed + 1);
  // Half of them of extremes, where sums are rounded and saturate.
  random.fill(image, cv::RNG::UNIFORM, 0, 256);
  if (seed % 2 == 0) image = (image > 127) / 255 * 255;
  return image;
}

// Debian's OpenCV for aarch64 multiplies and adds at once, which rounds once instead of twice: some values are the
// neighbours of those on x86-64, and of ours, which are the same everywhere.
#ifdef __aarch64__
constexpr int kMaxDifference = 1;
#else
constexpr int kMaxDifference = 0;
#endif

void expect_as_opencv(int from_width, int from_height, int to_width, int to_height, int channels, uint64_t seed) {
  // A part of a wider image, so that rows have padding.
  const cv::Mat whole = noise(from_width + int(seed % 4), from_height, channels, seed);
  const cv::Mat from = whole(cv::Rect(0, 0, from_width, from_height));
  const bool shrinks = to_width <= from_width && to_height <= from_height;
  cv::Mat expected;
  cv::resize(from, expected, cv::Size(to_width, to_height), 0, 0, shrinks ? cv::INTER_AREA : cv::INTER_LINEAR);
  cv::Mat to(to_height, to_width + 3, CV_8UC(channels), cv::Scalar::all(0xA5));
  maq::resize({from.data, from.step, from_width, from_height, channels},
              {to.data, to.step, to_width, to_height, channels});
  const size_t bytes = size_t(to_width * channels);
  for (int y = 0; y < to_height; ++y) {
    int difference = 0;
    for (size_t i = 0; i < bytes; ++i) difference = std::max(difference, std::abs(expected.ptr(y)[i] - to.ptr(y)[i]));
    ASSERT_LE(difference, kMaxDifference) << from_width << " x " << from_height << " to " << to_width << " x "
                                          << to_height << ", " << channels << " channels, row " << y;
    for (size_t i = 0; i < size_t(3 * channels); ++i) ASSERT_EQ(to.ptr(y)[bytes + i], 0xA5) << "beyond the row";
  }
}

TEST(Resize, IsToTheBitThatOfOpenCvAtRandomSizes) {
  std::mt19937 random(3);
  const auto side = [&](int most) { return 1 + int(random() % unsigned(most)); };
  for (uint64_t seed = 0; seed < 1500; ++seed) {
    const int most = seed % 50 == 0 ? 900 : 90;
    const int width = side(most), height = side(most), to_width = side(most), to_height = side(most);
    const int channels = seed % 3 == 0 ? 1 : seed % 3 == 1 ? 3 : 4;
    expect_as_opencv(width, height, to_width, to_height, channels, seed);
    if (HasFatalFailure()) return;
  }
}

TEST(Resize, IsToTheBitThatOfOpenCvByWholeFactors) {
  uint64_t seed = 0;
  for (const int channels : {1, 3, 4}) {
    for (int factor_x = 1; factor_x <= 7; ++factor_x) {
      for (int factor_y = 1; factor_y <= 7; ++factor_y) {
        expect_as_opencv(37 * factor_x, 11 * factor_y, 37, 11, channels, seed++);
        if (HasFatalFailure()) return;
      }
    }
    // 1 / (1 / 49) is not 49 in doubles, and so it is for other factors.
    for (const int factor : {41, 47, 49, 55, 61, 82, 83, 98, 103}) {
      expect_as_opencv(3 * factor, 2 * factor, 3, 2, channels, seed++);
      expect_as_opencv(factor, factor, 1, 1, channels, seed++);
      if (HasFatalFailure()) return;
    }
  }
}

TEST(Resize, IsToTheBitThatOfOpenCvAtTheSizesOfPhotosAndFrames) {
  uint64_t seed = 0;
  const int cases[][4] = {{640, 480, 320, 240},    {640, 480, 320, 241},
                          {640, 427, 500, 333},    {1920, 1080, 640, 360},
                          {4000, 3000, 1024, 768}, {3024, 4032, 960, 1280},
                          {128, 256, 171, 342},    {128, 256, 100, 200},
                          {1, 1, 640, 480},        {1, 4000, 1, 320},
                          {4000, 1, 320, 1},       {640, 480, 641, 200},
                          {640, 480, 200, 700},    {2, 2, 1, 1},
                          {1280, 720, 1920, 1080}};
  for (const auto& [width, height, to_width, to_height] : cases) {
    for (const int channels : {1, 3, 4}) {
      expect_as_opencv(width, height, to_width, to_height, channels, seed++);
      if (HasFatalFailure()) return;
    }
  }
}

TEST(Resize, FramesOfAnyFormatBecomeBgrOfTheSizeThatIsAsked) {
  const cv::Mat grey = noise(31, 17, 1, 1);
  cv::Mat bgr, expected;
  cv::cvtColor(grey, bgr, cv::COLOR_GRAY2BGR);
  for (const cv::Size size : {cv::Size(40, 9), cv::Size(15, 8), cv::Size(31, 17)}) {
    const bool shrinks = size.width <= 31 && size.height <= 17;
    cv::resize(bgr, expected, size, 0, 0, shrinks ? cv::INTER_AREA : cv::INTER_LINEAR);
    maq::Frame frame;
    maq::resize_to_bgr({MAQ_PIXEL_GREY8, 31, 17, {{grey.data, grey.step}, {}}}, size.width, size.height, frame);
    ASSERT_EQ(frame.image.width_px, size.width);
    ASSERT_EQ(frame.storage.size(), expected.total() * 3);
    EXPECT_EQ(std::memcmp(frame.storage.data(), expected.data, frame.storage.size()), 0) << size;
  }
}

TEST(Resize, WhatIsValidStaysValidWhereAllItCoversIs) {
  std::mt19937 random(8);
  for (const auto& [width, height, to_width, to_height] :
       {std::array{40, 30, 20, 15}, {41, 33, 17, 32}, {9, 9, 9, 9}}) {
    std::vector<uint8_t> valid(size_t(width * height));
    for (uint8_t& value : valid) value = random() % 16 == 0 ? 0 : uint8_t(1 + random() % 255);
    cv::Mat from(height, width, CV_8UC1, valid.data()), expected;
    from = from.clone();
    cv::threshold(from, from, 0, 255, cv::THRESH_BINARY);
    cv::resize(from, expected, cv::Size(to_width, to_height), 0, 0, cv::INTER_AREA);
    cv::threshold(expected, expected, 254, 255, cv::THRESH_BINARY);
    maq::shrink_valid(valid, width, height, to_width, to_height);
    EXPECT_EQ(valid, std::vector<uint8_t>(expected.begin<uint8_t>(), expected.end<uint8_t>()));
  }
}

TEST(Resize, WhatDoesNotShrinkIsRefused) {
  maq::Frame frame, smaller;
  frame.allocate_bgr(8, 6);
  expect_error(MAQ_ERROR_INVALID_ARGUMENT, "8 x 6", [&] { maq::shrink(frame.image, 9, 6, smaller); });
  expect_error(MAQ_ERROR_INVALID_ARGUMENT, "to 8 x 0", [&] { maq::shrink(frame.image, 8, 0, smaller); });
  maq::ImageView grey = frame.image;
  grey.format = MAQ_PIXEL_GREY8;
  expect_error(MAQ_ERROR_INVALID_ARGUMENT, "GREY8", [&] { maq::shrink(grey, 4, 3, smaller); });
}

}  // namespace
