// Noise of depth cameras, against the statistics that it is defined by.
#include "sources/synthetic/depth_noise.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

namespace {

size_t unknown(const std::vector<float>& metres) { return size_t(std::count(metres.begin(), metres.end(), 0.0f)); }

class DepthNoise : public ::testing::Test {
 protected:
  static constexpr maq::SolidsPicture kSize{320, 240};

  // Depth of a plane in the left part of the image, and of a plane at another depth.
  static std::vector<float> two_planes(float left, float right, int border = 160) {
    std::vector<float> metres(320 * 240);
    for (size_t i = 0; i < metres.size(); ++i) metres[i] = int(i % 320) < border ? left : right;
    return metres;
  }
  static std::vector<float> seen(const std::string& noise, std::vector<float> metres, uint64_t frame = 0) {
    maq::DepthNoise(noise, 7).apply(kSize, frame, metres.data());
    return metres;
  }
  template <class Value>
  static std::pair<double, double> mean_and_deviation(const std::vector<float>& metres, Value value) {
    double sum = 0, squares = 0;
    for (const float depth : metres) {
      sum += value(double(depth));
      squares += value(double(depth)) * value(double(depth));
    }
    const double mean = sum / double(metres.size());
    return {mean, std::sqrt(squares / double(metres.size()) - mean * mean)};
  }
};

TEST_F(DepthNoise, OfStereoIsAnErrorOfDisparityInSteps) {
  for (const float depth : {0.5f, 1.0f, 3.0f}) {
    const std::vector<float> found = seen("stereo", two_planes(depth, depth));
    const auto disparity = [](double metres) { return kSize.focal_px() * 0.05 / metres; };
    const auto [mean, deviation] = mean_and_deviation(found, disparity);
    EXPECT_NEAR(mean, disparity(double(depth)), 0.01);
    EXPECT_NEAR(deviation, std::hypot(0.08, 0.0625 / std::sqrt(12)), 0.01) << depth;
    for (const float metres : found) {
      const double steps = disparity(double(metres)) * 16;
      ASSERT_NEAR(steps, std::round(steps), 1e-3);
    }
  }
}

TEST_F(DepthNoise, OfTimeOfFlightGrowsWithTheRangeAndEndsWithIt) {
  for (const float depth : {0.5f, 2.0f, 5.0f}) {
    const auto [mean, deviation] =
        mean_and_deviation(seen("tof", two_planes(depth, depth)), [](double metres) { return metres; });
    const double expected = 0.001 + 0.0005 * double(depth) * double(depth);
    EXPECT_NEAR(mean, double(depth), expected * 0.05);
    EXPECT_NEAR(deviation, expected, expected * 0.05);
  }
  EXPECT_EQ(unknown(seen("tof", two_planes(6.5f, 6.5f))), 320u * 240);
}

TEST_F(DepthNoise, IsAnotherInEachFrameAndNeverMakesDepthOfNothing) {
  for (const char* noise : {"stereo", "tof"}) {
    const std::vector<float> plane = two_planes(1, 1);
    EXPECT_EQ(seen(noise, plane, 5), seen(noise, plane, 5));
    EXPECT_NE(seen(noise, plane, 5), seen(noise, plane, 6));
    const std::vector<float> nothing = seen(noise, two_planes(0, 0));
    EXPECT_EQ(unknown(nothing), nothing.size());
    for (const float metres : seen(noise, two_planes(0, 1))) ASSERT_TRUE(std::isfinite(metres) && metres >= 0);
  }
  EXPECT_EQ(seen("none", two_planes(1, 2)), two_planes(1, 2));
}

}  // namespace
