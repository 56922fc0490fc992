#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstring>
#include <opencv2/imgproc.hpp>

#include "core/frame.h"
#include "image/convert.h"
#include "support/expect_error.h"

namespace {

using maq::ImageView;

// An image of one colour in any format, with `padding` bytes of rubbish after each row.
class OneColour {
 public:
  OneColour(maq_pixel_format format, int width, int height, std::array<uint8_t, 3> rgb, size_t padding) {
    view_ = {format, width, height, {}};
    for (int plane = 0; plane < maq::plane_count(format); ++plane) {
      const size_t bytes = maq::row_bytes(format, plane, width);
      const size_t stride = bytes + padding;
      auto& storage = storage_[size_t(plane)];
      storage.assign(stride * size_t(maq::plane_rows(format, plane, height)), 0xEE);
      for (int y = 0; y < maq::plane_rows(format, plane, height); ++y) {
        uint8_t* row = storage.data() + size_t(y) * stride;
        for (size_t i = 0; i < bytes; ++i) row[i] = byte(format, plane, i, rgb);
      }
      view_.planes[plane] = {storage.data(), stride};
    }
  }

  const ImageView& view() const { return view_; }

 private:
  static uint8_t byte(maq_pixel_format format, int plane, size_t i, const std::array<uint8_t, 3>& rgb) {
    // BT.601, video range.
    const double r = rgb[0], g = rgb[1], b = rgb[2];
    const auto y = uint8_t(std::lround(16 + 0.257 * r + 0.504 * g + 0.098 * b));
    const auto u = uint8_t(std::lround(128 - 0.148 * r - 0.291 * g + 0.439 * b));
    const auto v = uint8_t(std::lround(128 + 0.439 * r - 0.368 * g - 0.071 * b));
    switch (format) {
      case MAQ_PIXEL_RGB8: return rgb[i % 3];
      case MAQ_PIXEL_BGR8: return rgb[2 - i % 3];
      case MAQ_PIXEL_RGBA8: return i % 4 == 3 ? 77 : rgb[i % 4];
      case MAQ_PIXEL_GREY8: return uint8_t(std::lround(0.299 * r + 0.587 * g + 0.114 * b));
      case MAQ_PIXEL_NV12: return plane == 0 ? y : i % 2 == 0 ? u : v;
      case MAQ_PIXEL_DEPTH16:
      case MAQ_PIXEL_DEPTH32F: break;
      case MAQ_PIXEL_YUYV: return i % 4 == 1 ? u : i % 4 == 3 ? v : y;
    }
    return 0;
  }

  ImageView view_;
  std::vector<uint8_t> storage_[2];
};

constexpr maq_pixel_format kColourFormats[] = {MAQ_PIXEL_RGB8, MAQ_PIXEL_BGR8, MAQ_PIXEL_RGBA8, MAQ_PIXEL_NV12,
                                               MAQ_PIXEL_YUYV};

TEST(FrameFormats, EveryFormatGivesTheSameColourWithAndWithoutPaddingAtOddSizes) {
  const std::array<uint8_t, 3> rgb = {200, 90, 40};
  for (const maq_pixel_format format : kColourFormats) {
    for (const auto& [width, height] : {std::pair{16, 8}, {1, 1}, {31, 33}, {5, 2}, {2, 5}, {1, 400}}) {
      for (const size_t padding : {0, 13}) {
        const OneColour image(format, width, height, rgb, padding);
        std::vector<uint8_t> pixels(size_t(width * height) * 3);
        maq::copy_pixels(image.view(), MAQ_PIXEL_RGB8, pixels.data(), 0, pixels.size());
        const int tolerance = format == MAQ_PIXEL_NV12 || format == MAQ_PIXEL_YUYV ? 3 : 0;
        for (size_t i = 0; i < pixels.size(); ++i) {
          ASSERT_NEAR(pixels[i], rgb[i % 3], tolerance)
              << maq::pixel_format_name(format) << " " << width << " x " << height << " padding " << padding;
        }
      }
    }
  }
}

TEST(FrameFormats, CopiesGoToEveryPackedFormat) {
  const OneColour image(MAQ_PIXEL_RGB8, 3, 2, {200, 90, 40}, 5);
  std::vector<uint8_t> bgr(18), rgba(24), grey(6);
  maq::copy_pixels(image.view(), MAQ_PIXEL_BGR8, bgr.data(), 0, bgr.size());
  maq::copy_pixels(image.view(), MAQ_PIXEL_RGBA8, rgba.data(), 0, rgba.size());
  maq::copy_pixels(image.view(), MAQ_PIXEL_GREY8, grey.data(), 0, grey.size());
  EXPECT_EQ(bgr[0], 40);
  EXPECT_EQ(rgba[0], 200);
  EXPECT_EQ(rgba[3], 255);
  EXPECT_NEAR(grey[0], 117, 1);
}

TEST(FrameFormats, CopiesLeaveThePaddingOfTheTargetAlone) {
  const OneColour image(MAQ_PIXEL_RGB8, 3, 2, {200, 90, 40}, 0);
  std::vector<uint8_t> target(16 + 9, 0xAB);  // the last row needs no padding
  maq::copy_pixels(image.view(), MAQ_PIXEL_RGB8, target.data(), 16, target.size());
  EXPECT_EQ(target[9], 0xAB);
  EXPECT_EQ(target[15], 0xAB);
  EXPECT_EQ(target[16], 200);
  expect_error(MAQ_ERROR_INVALID_ARGUMENT, "take 25 bytes",
               [&] { maq::copy_pixels(image.view(), MAQ_PIXEL_RGB8, target.data(), 16, 24); });
  expect_error(MAQ_ERROR_INVALID_ARGUMENT, "takes 9 bytes",
               [&] { maq::copy_pixels(image.view(), MAQ_PIXEL_RGB8, target.data(), 8, 100); });
  expect_error(MAQ_ERROR_UNSUPPORTED, "NV12",
               [&] { maq::copy_pixels(image.view(), MAQ_PIXEL_NV12, target.data(), 0, 100); });
}

TEST(FrameFormats, SizesOutsideTheLimitsAreRefused) {
  EXPECT_NO_THROW(maq::check_image_size(1, 1, "x"));
  EXPECT_NO_THROW(maq::check_image_size(MAQ_MAX_SIDE_PX, 4096, "x"));
  expect_error(MAQ_ERROR_IMAGE_SIZE, "at least one pixel", [] { maq::check_image_size(0, 5, "x"); });
  expect_error(MAQ_ERROR_IMAGE_SIZE, "at least one pixel", [] { maq::check_image_size(5, -1, "x"); });
  expect_error(MAQ_ERROR_IMAGE_SIZE, "over the limit", [] { maq::check_image_size(MAQ_MAX_SIDE_PX + 1, 1, "x"); });
  expect_error(MAQ_ERROR_IMAGE_SIZE, "over the limit", [] { maq::check_image_size(16384, 4097, "x"); });
}

TEST(FrameFormats, BytesOfRowsThatNoArrayHasAreNone) {
  EXPECT_EQ(maq::bytes_of_rows(10, 1, 7), 7u);
  EXPECT_EQ(maq::bytes_of_rows(10, 3, 7), 27u);
  EXPECT_EQ(maq::bytes_of_rows(size_t(PTRDIFF_MAX) - 7, 2, 7), size_t(PTRDIFF_MAX));
  EXPECT_EQ(maq::bytes_of_rows(size_t(PTRDIFF_MAX) - 6, 2, 7), std::nullopt);
  EXPECT_EQ(maq::bytes_of_rows(SIZE_MAX, 2, 7), std::nullopt);
  EXPECT_EQ(maq::bytes_of_rows(SIZE_MAX / 2 + 1, 3, 7), std::nullopt);
}

TEST(FrameFormats, DescriptionsAreCheckedPlaneByPlane) {
  std::vector<uint8_t> bytes(1000);
  maq_frame_desc desc{};
  desc.format = MAQ_PIXEL_NV12;
  desc.width_px = 5;
  desc.height_px = 5;
  desc.planes[0] = bytes.data();
  expect_error(MAQ_ERROR_INVALID_ARGUMENT, "planes[1] is NULL", [&] { maq::checked_image_view(desc); });
  desc.planes[1] = bytes.data();
  EXPECT_EQ(maq::checked_image_view(desc).planes[1].stride_bytes, 6u) << "colour of an odd width is rounded up";
  desc.stride_bytes[1] = 5;
  expect_error(MAQ_ERROR_INVALID_ARGUMENT, "stride_bytes[1] is 5", [&] { maq::checked_image_view(desc); });
  desc.format = maq_pixel_format(0);
  expect_error(MAQ_ERROR_UNSUPPORTED, "Pixel format 0", [&] { maq::checked_image_view(desc); });
}

// An image of noise in any format, rows of odd padding.
class Noise {
 public:
  Noise(maq_pixel_format format, int width, int height, int seed) {
    view_ = {format, width, height, {}};
    cv::RNG random(uint64_t(seed) + 1);
    for (int plane = 0; plane < maq::plane_count(format); ++plane) {
      const size_t stride = maq::row_bytes(format, plane, width) + size_t(seed % 3) * 7;
      planes_[plane] = cv::Mat(maq::plane_rows(format, plane, height), int(stride), CV_8UC1);
      random.fill(planes_[plane], cv::RNG::UNIFORM, 0, 256);
      view_.planes[plane] = {planes_[plane].data, stride};
    }
  }

  const ImageView& view() const { return view_; }
  cv::Mat mat(int plane, int cols, int type) const {
    return cv::Mat(planes_[plane].rows, cols, type, planes_[plane].data, planes_[plane].step);
  }

 private:
  ImageView view_;
  cv::Mat planes_[2];
};

// OpenCV wants even sizes for subsampled colour: the last row and column are repeated.
cv::Mat by_opencv(const Noise& image) {
  const int width = image.view().width_px, height = image.view().height_px;
  const int even_width = (width + 1) / 2 * 2, even_height = (height + 1) / 2 * 2;
  cv::Mat bgr;
  switch (image.view().format) {
    case MAQ_PIXEL_BGR8: return image.mat(0, width, CV_8UC3);
    case MAQ_PIXEL_RGB8: cv::cvtColor(image.mat(0, width, CV_8UC3), bgr, cv::COLOR_RGB2BGR); break;
    case MAQ_PIXEL_RGBA8: cv::cvtColor(image.mat(0, width, CV_8UC4), bgr, cv::COLOR_RGBA2BGR); break;
    case MAQ_PIXEL_GREY8: cv::cvtColor(image.mat(0, width, CV_8UC1), bgr, cv::COLOR_GRAY2BGR); break;
    case MAQ_PIXEL_YUYV: cv::cvtColor(image.mat(0, even_width, CV_8UC2), bgr, cv::COLOR_YUV2BGR_YUYV); break;
    case MAQ_PIXEL_NV12: {
      cv::Mat luma;
      cv::copyMakeBorder(image.mat(0, width, CV_8UC1), luma, 0, even_height - height, 0, even_width - width,
                         cv::BORDER_REPLICATE);
      cv::cvtColorTwoPlane(luma, image.mat(1, even_width / 2, CV_8UC2), bgr, cv::COLOR_YUV2BGR_NV12);
      break;
    }
    case MAQ_PIXEL_DEPTH16:
    case MAQ_PIXEL_DEPTH32F: break;
  }
  return bgr(cv::Rect(0, 0, width, height)).clone();
}

void expect_same_rows(const cv::Mat& expected, const uint8_t* pixels, size_t stride, const std::string& what) {
  for (int y = 0; y < expected.rows; ++y) {
    ASSERT_EQ(std::memcmp(expected.ptr(y), pixels + size_t(y) * stride, size_t(expected.cols) * expected.elemSize()), 0)
        << what << " " << expected.cols << " x " << expected.rows << ", row " << y;
  }
}

constexpr std::pair<int, int> kSizes[] = {{1, 1},   {2, 1},   {1, 2},   {3, 3},     {16, 2},    {31, 33}, {127, 5},
                                          {128, 4}, {129, 3}, {257, 4}, {640, 480}, {333, 251}, {1, 400}, {1000, 1}};

TEST(FrameFormats, EveryPixelIsToTheBitThatOfOpenCv) {
  int seed = 0;
  for (const maq_pixel_format format :
       {MAQ_PIXEL_RGB8, MAQ_PIXEL_BGR8, MAQ_PIXEL_RGBA8, MAQ_PIXEL_GREY8, MAQ_PIXEL_NV12, MAQ_PIXEL_YUYV}) {
    for (const auto& [width, height] : kSizes) {
      const Noise image(format, width, height, seed++);
      const std::string what = maq::pixel_format_name(format);
      const cv::Mat expected = by_opencv(image);
      std::vector<uint8_t> memory;
      const ImageView bgr = maq::as_bgr(image.view(), memory);
      expect_same_rows(expected, bgr.planes[0].data, bgr.planes[0].stride_bytes, what);
      const std::pair<maq_pixel_format, int> targets[] = {{MAQ_PIXEL_RGB8, cv::COLOR_BGR2RGB},
                                                          {MAQ_PIXEL_RGBA8, cv::COLOR_BGR2RGBA},
                                                          {MAQ_PIXEL_GREY8, cv::COLOR_BGR2GRAY}};
      for (const auto& [target, code] : targets) {
        cv::Mat converted;
        cv::cvtColor(expected, converted, code);
        const size_t stride = size_t(width) * converted.elemSize() + 5;
        std::vector<uint8_t> pixels(stride * size_t(height));
        maq::copy_pixels(image.view(), target, pixels.data(), stride, pixels.size());
        expect_same_rows(converted, pixels.data(), stride, what + " to " + maq::pixel_format_name(target));
      }
    }
  }
}

// Every luma with every pair of chromas that is a multiple of 3, which has the extremes.
TEST(FrameFormats, EveryColourOfYuvIsToTheBitThatOfOpenCv) {
  cv::Mat luma(512, 256 * 2, CV_8UC1), chroma(256, 256, CV_8UC2);
  for (int v = 0; v < 256; v += 3) {
    for (int y = 0; y < luma.rows; ++y) {
      for (int x = 0; x < luma.cols; ++x) luma.at<uint8_t>(y, x) = uint8_t(y / 2);
    }
    for (int y = 0; y < 256; ++y) {
      for (int x = 0; x < 256; ++x) chroma.at<cv::Vec2b>(y, x) = {uint8_t(x), uint8_t(v)};
    }
    cv::Mat expected;
    cv::cvtColorTwoPlane(luma, chroma, expected, cv::COLOR_YUV2BGR_NV12);
    std::vector<uint8_t> memory;
    const ImageView bgr = maq::as_bgr(
        {MAQ_PIXEL_NV12, luma.cols, luma.rows, {{luma.data, luma.step}, {chroma.data, chroma.step}}}, memory);
    expect_same_rows(expected, bgr.planes[0].data, bgr.planes[0].stride_bytes, "v " + std::to_string(v));
  }
}

}  // namespace
