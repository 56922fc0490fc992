#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

#include "image/network_input.h"

namespace {

maq::ImageView view_of(const cv::Mat& bgr) { return {MAQ_PIXEL_BGR8, bgr.cols, bgr.rows, {{bgr.data, bgr.step}, {}}}; }

const maq::NetworkInputSpec kSpec = {32, {123.675f, 116.28f, 103.53f}, {58.395f, 57.12f, 57.375f}};

void make(const cv::Mat& bgr, maq::NetworkInput& input) {
  make_network_input(view_of(bgr), maq::network_size(bgr.cols, bgr.rows, 320), kSpec, input);
}

// The definition in Python: cv2.resize of the bytes, then (value - mean) / std in float32, RGB planes, zeros around.
// The library does not round to bytes in between, which is half a grey level at most, and OpenCV's bilinear weights are
// fixed-point numbers.
void expect_definition(const cv::Mat& bgr, int width, int height, int interpolation) {
  const float max_grey_levels = interpolation < 0 ? 1e-4f : interpolation == cv::INTER_AREA ? 0.502f : 0.9f;
  maq::NetworkInput input;
  input.values.assign(1 << 20, 1e9f);  // what an earlier image left
  make(bgr, input);
  ASSERT_EQ(input.width_px, width);
  ASSERT_EQ(input.height_px, height);
  ASSERT_EQ(input.padded_width_px % 32, 0);
  ASSERT_LT(input.padded_width_px - width, 32);
  ASSERT_LT(input.padded_height_px - height, 32);
  ASSERT_EQ(input.values.size(), size_t(3 * input.padded_width_px * input.padded_height_px));
  cv::Mat resized = bgr;
  if (bgr.size() != cv::Size(width, height)) cv::resize(bgr, resized, cv::Size(width, height), 0, 0, interpolation);
  for (int c = 0; c < 3; ++c) {
    for (int y = 0; y < input.padded_height_px; ++y) {
      for (int x = 0; x < input.padded_width_px; ++x) {
        const float value = input.values[size_t((c * input.padded_height_px + y) * input.padded_width_px + x)];
        const bool inside = x < width && y < height;
        const float expected =
            inside ? (float(resized.at<cv::Vec3b>(y, x)[2 - c]) - kSpec.mean[size_t(c)]) / kSpec.std[size_t(c)] : 0;
        ASSERT_NEAR(value, expected, max_grey_levels / kSpec.std[size_t(c)]) << c << " " << x << " " << y;
        ASSERT_TRUE(inside || value == 0) << "padding";
      }
    }
  }
}

cv::Mat colour_noise(int width, int height) {
  cv::Mat image(height, width, CV_8UC3);
  cv::theRNG().state = 42;
  cv::randu(image, 0, 256);
  return image;
}

TEST(NetworkInput, ShrinksByAreaAndNormalises) { expect_definition(colour_noise(640, 427), 320, 214, cv::INTER_AREA); }

TEST(NetworkInput, GrowsBilinearly) { expect_definition(colour_noise(100, 160), 200, 320, cv::INTER_LINEAR); }

TEST(NetworkInput, LeavesAnImageOfTheRightSizeAsItIs) { expect_definition(colour_noise(320, 256), 320, 256, -1); }

TEST(NetworkInput, TakesOddSizesDownToOnePixel) {
  expect_definition(colour_noise(31, 33), 301, 320, cv::INTER_LINEAR);
  expect_definition(colour_noise(1, 1), 320, 320, cv::INTER_LINEAR);
  expect_definition(colour_noise(1, 4000), 1, 320, cv::INTER_AREA);
  expect_definition(colour_noise(4000, 1), 320, 1, cv::INTER_AREA);
  expect_definition(colour_noise(16, 16), 320, 320, cv::INTER_LINEAR);
}

TEST(NetworkInput, RoundsHalvesToEvenLikeTheReference) {
  EXPECT_EQ(maq::network_size(640, 125, 320).height_px, 62);  // of 62.5
  EXPECT_EQ(maq::network_size(127, 640, 320).width_px, 64);   // of 63.5
}

TEST(NetworkInput, WhatAnEarlierFrameOfAnotherSizeLeftDoesNotMatter) {
  maq::NetworkInput used, fresh;
  for (const cv::Mat& image : {colour_noise(640, 480), colour_noise(333, 500), colour_noise(640, 480)}) {
    make(image, used);
  }
  make(colour_noise(640, 480), fresh);
  EXPECT_EQ(used.values, fresh.values);
}

TEST(NetworkInput, ReadsRowsByTheirStride) {
  const cv::Mat large = colour_noise(400, 300);
  const cv::Mat part = large(cv::Rect(7, 3, 320, 256));
  expect_definition(part, 320, 256, -1);
}

}  // namespace
