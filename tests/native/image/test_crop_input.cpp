#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "image/convert.h"
#include "image/crop_input.h"

namespace {

using maq::AffineMap;
using maq::Point;

constexpr int kSide = 64;
const maq::NetworkInputSpec kCropSpec = {32, {123.675f, 116.28f, 103.53f}, {58.395f, 57.12f, 57.375f}};

// A crop whose middle is `middle` of the image, rotated by `degrees`; `scale`: crop pixels for one of the image.
AffineMap crop_map(const Point& middle, double degrees, double scale) {
  const double c = std::cos(degrees * 0.017453292519943295) / scale,
               s = std::sin(degrees * 0.017453292519943295) / scale;
  AffineMap map;
  map.xx = map.yy = c;
  map.xy = -s;
  map.yx = s;
  map.shift_x = middle.x - (c - s) * kSide / 2;
  map.shift_y = middle.y - (s + c) * kSide / 2;
  return map;
}

// Values of the crop in 0..255, R, G, B.
std::vector<float> cut(const maq::ImageView& image, const AffineMap& to_image) {
  maq::CropInput crop;
  crop.values.assign(7, 1e9f);  // what an earlier crop left
  make_crop_input(image, to_image, {kSide, kSide}, kCropSpec, crop);
  EXPECT_EQ(crop.values.size(), size_t(3 * kSide * kSide));
  for (size_t i = 0; i < crop.values.size(); ++i) {
    const size_t c = i / (kSide * kSide);
    crop.values[i] = crop.values[i] * kCropSpec.std[c] + kCropSpec.mean[c];
  }
  return crop.values;
}

// Red rises to the right and green downwards, by `slope` a pixel, from 0 in the corner.
std::vector<uint8_t> ramp(int width, int height, int slope) {
  std::vector<uint8_t> bgr(size_t(3 * width * height), 50);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      uint8_t* pixel = bgr.data() + 3 * (y * width + x);
      pixel[2] = uint8_t(slope * x);
      pixel[1] = uint8_t(slope * y);
    }
  }
  return bgr;
}

TEST(CropInput, ShowsEachPlaceOfTheImageWhereTheMapPutsIt) {
  const std::vector<uint8_t> bgr = ramp(250, 240, 1);
  const maq::ImageView image = maq::packed_view(MAQ_PIXEL_BGR8, 250, 240, bgr.data());
  for (const double scale : {0.4, 0.55, 0.8, 1.0, 1.7}) {
    for (const double degrees : {0.0, 20.0, 90.0, -135.0, 180.0}) {
      const AffineMap to_image = crop_map({124.3, 121.9}, degrees, scale);
      const std::vector<float> values = cut(image, to_image);
      for (int y = 0; y < kSide; ++y) {
        for (int x = 0; x < kSide; ++x) {
          const Point at = to_image({x + 0.5, y + 0.5});
          // A ramp stays one when it is averaged; only at the border of the image it does not.
          if (at.x < 4 || at.y < 4 || at.x > 246 || at.y > 236) continue;
          const size_t pixel = size_t(y * kSide + x);
          ASSERT_NEAR(values[pixel], at.x - 0.5, 0.07) << scale << " " << degrees;
          ASSERT_NEAR(values[kSide * kSide + pixel], at.y - 0.5, 0.07) << scale << " " << degrees;
          ASSERT_NEAR(values[2 * kSide * kSide + pixel], 50, 0.02);
        }
      }
    }
  }
}

TEST(CropInput, IsBilinearAndTheMeanColourBeyondTheImage) {
  std::mt19937 random(3);
  std::vector<uint8_t> bgr(3 * 37 * 29);
  for (uint8_t& value : bgr) value = uint8_t(random());
  const AffineMap to_image = crop_map({30, 8}, 33, 1.6);
  const std::vector<float> values = cut(maq::packed_view(MAQ_PIXEL_BGR8, 37, 29, bgr.data()), to_image);
  int beyond = 0;
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      const Point at = to_image({x + 0.5, y + 0.5});
      const double index_x = at.x - 0.5, index_y = at.y - 0.5;
      const int left = int(std::floor(index_x)), top = int(std::floor(index_y));
      for (int c = 0; c < 3; ++c) {
        double expected = 0;
        for (const int row : {top, top + 1}) {
          for (const int column : {left, left + 1}) {
            const double weight = (1 - std::abs(index_x - column)) * (1 - std::abs(index_y - row));
            const bool inside = row >= 0 && row < 29 && column >= 0 && column < 37;
            expected +=
                weight * (inside ? bgr[size_t(3 * (row * 37 + column) + 2 - c)] : double(kCropSpec.mean[size_t(c)]));
          }
        }
        ASSERT_NEAR(values[size_t((c * kSide + y) * kSide + x)], expected, 0.01) << x << " " << y;
      }
      beyond += at.x < -1 || at.y < -1 || at.x > 38 || at.y > 30;
    }
  }
  EXPECT_GT(beyond, 500);
}

TEST(CropInput, BesideTheImageIsTheMeanColour) {
  const std::vector<uint8_t> bgr(3 * 8 * 8, 255);
  for (const Point middle : {Point{-100, 4}, Point{4, 1e7}, Point{1e9, -1e9}}) {
    maq::CropInput crop;
    make_crop_input(maq::packed_view(MAQ_PIXEL_BGR8, 8, 8, bgr.data()), crop_map(middle, 10, 1), {kSide, kSide},
                    kCropSpec, crop);
    EXPECT_EQ(std::count(crop.values.begin(), crop.values.end(), 0.0f), 3 * kSide * kSide);
  }
}

TEST(CropInput, FormatsOfCamerasAreCutAsTheirBgrImages) {
  std::mt19937 random(4);
  for (const maq_pixel_format format :
       {MAQ_PIXEL_RGB8, MAQ_PIXEL_RGBA8, MAQ_PIXEL_GREY8, MAQ_PIXEL_NV12, MAQ_PIXEL_YUYV}) {
    std::vector<uint8_t> pixels(maq::packed_bytes(format, 75, 61));
    for (uint8_t& value : pixels) value = uint8_t(random());
    const maq::ImageView image = maq::packed_view(format, 75, 61, pixels.data());
    std::vector<uint8_t> memory;
    const maq::ImageView bgr = maq::as_bgr(image, memory);
    for (const Point middle : {Point{37.3, 30.1}, Point{70, 57}, Point{0, 0}}) {
      for (const double scale : {0.5, 2.6}) {
        const AffineMap to_image = crop_map(middle, -25, scale);
        EXPECT_EQ(cut(image, to_image), cut(bgr, to_image)) << maq::pixel_format_name(format);
      }
    }
  }
}

}  // namespace
