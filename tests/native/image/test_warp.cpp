// Warped images against reading them bilinearly at each pixel.
#include "image/geometry/warp.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "support/expect_error.h"

namespace {

constexpr int kFromWidth = 60, kFromHeight = 50, kWidth = 40, kHeight = 70;

// A smooth image of so many channels.
std::vector<uint8_t> smooth(int channels) {
  std::vector<uint8_t> pixels;
  for (int y = 0; y < kFromHeight; ++y) {
    for (int x = 0; x < kFromWidth; ++x) {
      for (int c = 0; c < channels; ++c) pixels.push_back(uint8_t(128 + 100 * std::sin(0.2 * x + 0.15 * y + c)));
    }
  }
  return pixels;
}

TEST(Warp, IsBilinearWithTheBorderRepeatedInAnyStrips) {
  const double angle = 0.4;
  const std::array<double, 6> back = {std::cos(angle), -std::sin(angle), 12.3, std::sin(angle), std::cos(angle), -5.1};
  for (const int channels : {1, 3}) {
    const std::vector<uint8_t> from = smooth(channels);
    std::vector<uint8_t> to(size_t(kWidth * kHeight * channels));
    for (int top = 0; top < kHeight; top += 32) {
      maq::warp_bytes({from.data(), kFromWidth, kFromHeight}, channels, back, {to.data(), kWidth, kHeight}, top,
                      std::min(kHeight, top + 32));
    }
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        const double at_x = std::clamp(back[0] * x + back[1] * y + back[2], 0.0, kFromWidth - 1.0);
        const double at_y = std::clamp(back[3] * x + back[4] * y + back[5], 0.0, kFromHeight - 1.0);
        const int x0 = int(at_x), y0 = int(at_y), x1 = std::min(x0 + 1, kFromWidth - 1),
                  y1 = std::min(y0 + 1, kFromHeight - 1);
        for (int c = 0; c < channels; ++c) {
          const auto pixel = [&](int px, int py) {
            return double(from[size_t((py * kFromWidth + px) * channels + c)]);
          };
          const double u = at_x - x0, v = at_y - y0;
          const double expected = (1 - v) * ((1 - u) * pixel(x0, y0) + u * pixel(x1, y0)) +
                                  v * ((1 - u) * pixel(x0, y1) + u * pixel(x1, y1));
          ASSERT_NEAR(to[size_t((y * kWidth + x) * channels + c)], expected, 0.6) << x << " " << y;
        }
      }
    }
  }
}

TEST(Warp, DepthsAreNotMixed) {
  std::vector<float> from(kFromWidth * kFromHeight);
  for (size_t i = 0; i < from.size(); ++i) from[i] = i % 2 == 0 ? 1.0f : 1000.0f;
  std::vector<float> to(kWidth * kHeight, -1);
  maq::warp_depths({from.data(), kFromWidth, kFromHeight}, {0.9, 0.3, 1, -0.3, 0.9, 20}, {to.data(), kWidth, kHeight},
                   0, kHeight);
  for (const float depth : to) EXPECT_TRUE(depth == 1 || depth == 1000) << depth;
}

TEST(Warp, PhotosBecomeRgbOfFloatsWithTheBorderRepeated) {
  const std::vector<uint8_t> from = smooth(3);
  const maq::PixelMap to_source = {0.9, 0.3, -4, -0.3, 0.9, 20};
  std::vector<float> rgb;
  maq::warp_to_rgb({MAQ_PIXEL_BGR8, kFromWidth, kFromHeight, {{from.data(), 3 * kFromWidth}, {}}}, to_source, kWidth,
                   kHeight, rgb);
  ASSERT_EQ(rgb.size(), size_t(3 * kWidth * kHeight));
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const double at_x = std::clamp(to_source[0] * x + to_source[1] * y + to_source[2], 0.0, kFromWidth - 1.0);
      const double at_y = std::clamp(to_source[3] * x + to_source[4] * y + to_source[5], 0.0, kFromHeight - 1.0);
      const int x0 = int(at_x), y0 = int(at_y);
      const int x1 = std::min(x0 + 1, kFromWidth - 1), y1 = std::min(y0 + 1, kFromHeight - 1);
      for (int c = 0; c < 3; ++c) {
        const auto pixel = [&](int px, int py) { return double(from[size_t((py * kFromWidth + px) * 3 + 2 - c)]); };
        const double u = at_x - x0, v = at_y - y0;
        const double expected =
            (1 - v) * ((1 - u) * pixel(x0, y0) + u * pixel(x1, y0)) + v * ((1 - u) * pixel(x0, y1) + u * pixel(x1, y1));
        ASSERT_NEAR(rgb[size_t((y * kWidth + x) * 3 + c)], expected / 255, 1e-6) << x << " " << y;
      }
    }
  }
}

TEST(Warp, APhotoThatIsNotBgrIsRefused) {
  std::vector<float> rgb;
  expect_error(MAQ_ERROR_INVALID_ARGUMENT, "GREY8", [&] {
    maq::warp_to_rgb({MAQ_PIXEL_GREY8, 1, 1, {}}, {1, 0, 0, 0, 1, 0}, 1, 1, rgb);
  });
}

}  // namespace
