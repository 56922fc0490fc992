#include "densepose/surface/frame_motion.h"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <string>

namespace frame_motion_tests {
namespace {

constexpr int kWidth = 640, kHeight = 480;

// Smooth noise, moved to the right and down.
cv::Mat picture(double x, double y, int width = kWidth, int height = kHeight) {
  cv::Mat noise(height / 12 + 1, width / 12 + 1, CV_8UC1), large, moved;
  cv::RNG random(3);
  random.fill(noise, cv::RNG::UNIFORM, 0, 256);
  cv::resize(noise, large, cv::Size(width, height), 0, 0, cv::INTER_CUBIC);
  cv::warpAffine(large, moved, cv::Matx23d(1, 0, x, 0, 1, y), large.size(), cv::INTER_CUBIC, cv::BORDER_REFLECT);
  return moved;
}

maq::ImageView view_of(const cv::Mat& grey) {
  maq::ImageView image{};
  image.format = MAQ_PIXEL_GREY8;
  image.width_px = grey.cols, image.height_px = grey.rows;
  image.planes[0] = {grey.data, grey.step[0]};
  return image;
}

TEST(FrameMotion, BlocksFollowWhatMoves) {
  maq::FrameMotion motion;
  const cv::Mat first = picture(0, 0);
  for (const auto& [x, y] : {std::pair{0.0, 0.0}, {6.0, -4.0}, {-11.0, 3.0}, {2.6, 1.4}, {20.0, 17.0}}) {
    SCOPED_TRACE(std::to_string(x) + ", " + std::to_string(y));
    const cv::Mat second = picture(x, y);
    motion.next(view_of(first), true);
    motion.next(view_of(second), true);
    ASSERT_TRUE(motion.is_known());
    for (const maq::Point& at : {maq::Point{320, 240}, {100, 400}, {500, 90}}) {
      EXPECT_NEAR(motion.at(at).x_px, x, 0.6);
      EXPECT_NEAR(motion.at(at).y_px, y, 0.6);
      EXPECT_LT(motion.at(at).mismatch, 12);
    }
  }
}

TEST(FrameMotion, NoiseMovesNothing) {
  maq::FrameMotion motion;
  cv::RNG random(1);
  for (int k = 0; k < 2; ++k) {
    cv::Mat noise(kHeight, kWidth, CV_16SC1), grey;
    random.fill(noise, cv::RNG::NORMAL, 128, 4);
    noise.convertTo(grey, CV_8U);
    motion.next(view_of(grey), true);
  }
  for (int x = 0; x < kWidth; x += 40) {
    EXPECT_EQ(motion.at({double(x), 200}).x_px, 0);
    EXPECT_EQ(motion.at({double(x), 200}).y_px, 0);
  }
}

TEST(FrameMotion, AnotherPictureDoesNotFit) {
  maq::FrameMotion motion;
  const cv::Mat first = picture(0, 0), second = 255 - picture(0, 0);
  motion.next(view_of(first), true);
  motion.next(view_of(second), true);
  EXPECT_GT(motion.at({320, 240}).mismatch, 20);
}

TEST(FrameMotion, ACutAnotherSizeAndDepthBeginAnew) {
  maq::FrameMotion motion;
  const cv::Mat first = picture(0, 0), other = picture(0, 0, 320, 200);
  motion.next(view_of(first), true);
  EXPECT_FALSE(motion.is_known());
  motion.next(view_of(first), false);
  EXPECT_FALSE(motion.is_known());
  motion.next(view_of(other), true);
  EXPECT_FALSE(motion.is_known());
  maq::ImageView depth = view_of(other);
  depth.format = MAQ_PIXEL_DEPTH16;
  motion.next(depth, true);
  EXPECT_FALSE(motion.is_known());
  motion.next(view_of(other), true);
  EXPECT_FALSE(motion.is_known());
  motion.next(view_of(other), true);
  EXPECT_TRUE(motion.is_known());
}

TEST(FrameMotion, ImagesOfAnySizeAndPointsAnywhere) {
  for (const cv::Size& size : {cv::Size{1, 1}, {16, 16}, {17, 33}, {3, 900}, {641, 479}, {4000, 2}}) {
    SCOPED_TRACE(std::to_string(size.width) + " x " + std::to_string(size.height));
    const cv::Mat image(size, CV_8UC1, cv::Scalar(90));
    maq::FrameMotion motion;
    motion.next(view_of(image), true);
    motion.next(view_of(image), true);
    if (!motion.is_known()) continue;
    for (const maq::Point& at : {maq::Point{-1e9, 1e9}, {0, 0}, {1e300, -1e300}, {size.width + 0.5, 0}}) {
      EXPECT_EQ(motion.at(at).x_px, 0);
      EXPECT_EQ(motion.at(at).mismatch, 0);
    }
  }
}

}  // namespace
}  // namespace frame_motion_tests
