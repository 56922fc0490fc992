#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstring>

#include "core/frame.h"
#include "support/expect_error.h"
#include "image/convert.h"

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
      case MAQ_PIXEL_DEPTH16: break;
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

}  // namespace
