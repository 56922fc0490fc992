#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "densepose/detector/roi_align.h"

namespace roi_align_tests {
namespace {

using maq::Box;
using maq::FeatureMap;

constexpr int kChannels = 3;

// RoIAlign by its definition, sample by sample in double.
double sample(const FeatureMap& map, int channel, double y, double x) {
  const int height = map.height, width = map.width;
  const auto cell = [&](int row, int column) {
    return double(map.data[size_t((row * width + column) * map.channels + channel)]);
  };
  if (y < -1 || y > height || x < -1 || x > width) return 0;
  y = std::max(y, 0.0);
  x = std::max(x, 0.0);
  int y0 = int(y), x0 = int(x);
  int y1 = y0 + 1, x1 = x0 + 1;
  if (y0 >= height - 1) y0 = y1 = height - 1, y = y0;
  if (x0 >= width - 1) x0 = x1 = width - 1, x = x0;
  const double fy = y - y0, fx = x - x0;
  return (1 - fy) * ((1 - fx) * cell(y0, x0) + fx * cell(y0, x1)) + fy * ((1 - fx) * cell(y1, x0) + fx * cell(y1, x1));
}

std::vector<double> reference(const FeatureMap& map, const Box& box, int pool) {
  const double x0 = double(box.x0) / map.stride - 0.5, y0 = double(box.y0) / map.stride - 0.5;
  const double width = double(box.x1) / map.stride - 0.5 - x0, height = double(box.y1) / map.stride - 0.5 - y0;
  const int nx = int(std::ceil(float(width) / float(pool))), ny = int(std::ceil(float(height) / float(pool)));
  std::vector<double> result;
  for (int py = 0; py < pool; ++py) {
    for (int px = 0; px < pool; ++px) {
      for (int c = 0; c < map.channels; ++c) {
        double sum = 0;
        for (int iy = 0; iy < ny; ++iy) {
          for (int ix = 0; ix < nx; ++ix) {
            sum +=
                sample(map, c, y0 + (py + (iy + 0.5) / ny) * height / pool, x0 + (px + (ix + 0.5) / nx) * width / pool);
          }
        }
        result.push_back(sum / std::max(1, nx * ny));
      }
    }
  }
  return result;
}

class RoiAlign : public ::testing::Test {
 protected:
  RoiAlign() : values_(size_t(kChannels) * kHeight * kWidth) {
    std::mt19937 random(3);
    std::uniform_real_distribution<float> uniform(-1, 1);
    for (float& value : values_) value = uniform(random);
    map_ = {values_.data(), kChannels, kHeight, kWidth, 4};
  }

  void expect_reference(const Box& box, int pool) {
    // Filled first, so that a value that is not written is seen.
    std::vector<float> output(size_t(kChannels * pool * pool), 1e9f);
    roi_align_.run(map_, box, pool, output.data());
    const std::vector<double> expected = reference(map_, box, pool);
    for (size_t i = 0; i < output.size(); ++i) {
      ASSERT_NEAR(double(output[i]), expected[i], 1e-5)
          << "value " << i << " of box " << box.x0 << " " << box.y0 << " " << box.x1 << " " << box.y1;
    }
  }

  static constexpr int kHeight = 20, kWidth = 24;  // 80 x 96 pixels at stride 4
  std::vector<float> values_;
  FeatureMap map_;
  maq::RoiAlign roi_align_;
};

TEST_F(RoiAlign, EqualsTheReferenceInsideTheMap) {
  expect_reference({8, 12, 64, 60}, 7);
  expect_reference({8.3f, 12.7f, 63.9f, 60.1f}, 7);
  expect_reference({20, 20, 76, 70}, 32);
}

TEST_F(RoiAlign, EqualsTheReferenceAtAndOverEachBorder) {
  for (const Box& box : {Box{0, 0, 40, 40}, Box{56, 40, 96, 80}, Box{-12, -9, 20, 20}, Box{80, 60, 130, 110},
                         Box{-30, 10, 200, 30}, Box{10, -50, 20, 150}}) {
    expect_reference(box, 7);
    expect_reference(box, 32);
  }
}

TEST_F(RoiAlign, EqualsTheReferenceForTinyAndHugeBoxes) {
  expect_reference({40, 40, 40.5f, 40.25f}, 7);
  expect_reference({40, 40, 40.001f, 40.001f}, 32);
  expect_reference({-1000, -1000, 1000, 1000}, 7);
  expect_reference({0, 0, 96, 80}, 7);
}

TEST_F(RoiAlign, GivesZerosOutsideTheMapAndForBoxesWithoutArea) {
  for (const Box& box : {Box{500, 500, 600, 600}, Box{-600, 0, -500, 50}, Box{30, 30, 30, 60}, Box{30, 60, 60, 30}}) {
    std::vector<float> output(kChannels * 49, 1e9f);
    roi_align_.run(map_, box, 7, output.data());
    for (const float value : output) EXPECT_EQ(value, 0);
  }
}

TEST_F(RoiAlign, EqualsTheReferenceOnRandomBoxes) {
  std::mt19937 random(11);
  std::uniform_real_distribution<float> x(-20, 110), y(-20, 95);
  for (int i = 0; i < 200; ++i) {
    const float a = x(random), b = x(random), c = y(random), d = y(random);
    expect_reference({std::min(a, b), std::min(c, d), std::max(a, b), std::max(c, d)}, i % 2 == 0 ? 7 : 32);
  }
}

}  // namespace
}  // namespace roi_align_tests
