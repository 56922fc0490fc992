#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <vector>

#include "core/frame.h"
#include "image/convert.h"
#include "image/depth.h"
#include "support/expect_error.h"

namespace {

template <class T>
maq::ImageView view_of(const std::vector<T>& pixels, int width, int height) {
  const auto* bytes = reinterpret_cast<const uint8_t*>(pixels.data());
  return maq::packed_view(sizeof(T) == 2 ? MAQ_PIXEL_DEPTH16 : MAQ_PIXEL_DEPTH32F, width, height, bytes);
}

template <class T>
std::vector<float> metres_of(const std::vector<T>& pixels) {
  std::vector<float> metres(pixels.size(), -1);
  maq::depth_in_metres(view_of(pixels, int(pixels.size()), 1), metres.data());
  return metres;
}

TEST(Depth, SixteenBitsAreMillimetresAndBothEndsAreUnknown) {
  std::vector<uint16_t> all(65536);
  for (size_t i = 0; i < all.size(); ++i) all[i] = uint16_t(i);
  const std::vector<float> metres = metres_of(all);
  EXPECT_EQ(metres[0], 0);
  EXPECT_EQ(metres[65535], 0);
  for (size_t i = 1; i < 65535; ++i) ASSERT_NEAR(metres[i], double(i) * 0.001, double(i) * 0.001 * 1.2e-7) << i;
}

TEST(Depth, FloatsThatAreNoDepthBecomeZeroAndTheOthersStayAsTheyAre) {
  using Limits = std::numeric_limits<float>;
  const std::vector<float> unknown = {0.0f,
                                      -0.0f,
                                      -1.0f,
                                      -Limits::infinity(),
                                      Limits::infinity(),
                                      Limits::quiet_NaN(),
                                      -Limits::quiet_NaN(),
                                      Limits::signaling_NaN(),
                                      Limits::denorm_min(),
                                      std::nextafter(Limits::min(), 0.0f),
                                      -Limits::max()};
  const std::vector<float> known = {Limits::min(), 1e-20f, 0.1f, 1.0f, 65.535f, 1e6f, Limits::max()};
  // At every place of a vector of the processor.
  for (size_t before = 0; before < 9; ++before) {
    std::vector<float> pixels(before, 3.0f);
    pixels.insert(pixels.end(), unknown.begin(), unknown.end());
    pixels.insert(pixels.end(), known.begin(), known.end());
    const std::vector<float> metres = metres_of(pixels);
    for (size_t i = 0; i < pixels.size(); ++i) {
      const bool is_unknown = i >= before && i < before + unknown.size();
      ASSERT_EQ(metres[i], is_unknown ? 0.0f : pixels[i]) << i - before;
      ASSERT_FALSE(std::signbit(metres[i])) << i - before;
    }
  }
}

TEST(Depth, AUnitScalesEitherFormat) {
  const std::vector<uint16_t> steps = {0, 1, 4000, 65534, 65535};
  const std::vector<float> centimetres = {-1, 0.5f, 250, 1e38f};
  std::vector<float> metres(5);
  maq::depth_in_metres(view_of(steps, 5, 1), 0.00025, metres.data());
  EXPECT_EQ(metres, (std::vector<float>{0, 0.00025f, 4000 * 0.00025f, 65534 * 0.00025f, 0}));
  maq::depth_in_metres(view_of(centimetres, 4, 1), 0.01, metres.data());
  EXPECT_EQ(metres, (std::vector<float>{0, 0.5f * 0.01f, 2.5f, 1e38f * 0.01f, 0}));
  maq::depth_in_metres(view_of(centimetres, 4, 1), 1000, metres.data());
  EXPECT_EQ(metres[3], 0) << "over the range of a float";
}

// Rows that begin at odd addresses, with rubbish behind each: as an app may wrap them.
TEST(Depth, RowsMayHaveAnyStrideAndAddress) {
  for (const maq_pixel_format format : {MAQ_PIXEL_DEPTH16, MAQ_PIXEL_DEPTH32F}) {
    for (const auto& [width, height] : {std::pair{1, 1}, {17, 31}, {4000, 1}, {1, 400}, {33, 2}}) {
      const size_t row = maq::row_bytes(format, 0, width), stride = row + 5;
      std::vector<uint8_t> memory(1 + stride * size_t(height), 0xEE);
      for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
          const float metres = float(1 + (x + 7 * y) % 500);
          const auto millimetres = uint16_t(1000 * (1 + (x + 7 * y) % 64));
          uint8_t* to = &memory[1 + size_t(y) * stride + size_t(x) * (row / size_t(width))];
          if (format == MAQ_PIXEL_DEPTH16) std::memcpy(to, &millimetres, 2);
          if (format == MAQ_PIXEL_DEPTH32F) std::memcpy(to, &metres, 4);
        }
      }
      std::vector<float> metres(size_t(width) * size_t(height) + 1, -7);
      maq::depth_in_metres({format, width, height, {{&memory[1], stride}, {}}}, metres.data());
      for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
          const int modulus = format == MAQ_PIXEL_DEPTH16 ? 64 : 500;
          ASSERT_FLOAT_EQ(metres[size_t(y) * size_t(width) + size_t(x)], float(1 + (x + 7 * y) % modulus));
        }
      }
      EXPECT_EQ(metres.back(), -7) << "nothing behind the end";
    }
  }
}

TEST(Depth, OfAFrameIsItsPixelsOrWhatCameWithThePicture) {
  maq::Frame frame;
  frame.allocate_bgr(4, 3);
  EXPECT_EQ(maq::depth_of(frame), nullptr);
  frame.depth.width_px = 4;
  EXPECT_EQ(maq::depth_of(frame), &frame.depth);
  for (const maq_pixel_format format : {MAQ_PIXEL_DEPTH16, MAQ_PIXEL_DEPTH32F}) {
    frame.clear();
    frame.allocate(format, 4, 3);
    EXPECT_EQ(frame.storage.size(), format == MAQ_PIXEL_DEPTH16 ? 24u : 48u);
    EXPECT_EQ(maq::depth_of(frame), &frame.image);
    std::vector<uint8_t> memory;
    expect_error(MAQ_ERROR_UNSUPPORTED, "A depth image has no colours", [&] { maq::as_bgr(frame.image, memory); });
  }
}

}  // namespace
