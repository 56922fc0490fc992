#include <gtest/gtest.h>

#include <cstring>
#include <random>

#include "densepose/surface/chart_predictor.h"
#include "support/expect_error.h"

namespace chart_predictor_tests {
namespace {

constexpr int kParts = 5, kChannels = 11, kSize = 6;

std::vector<uint8_t> bytes_of(const std::vector<float>& values) {
  std::vector<uint8_t> bytes(values.size() * sizeof(float));
  std::memcpy(bytes.data(), values.data(), bytes.size());
  return bytes;
}

std::vector<float> noise(size_t count, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<float> value;
  std::vector<float> values(count);
  for (float& v : values) v = value(random);
  return values;
}

const std::vector<float> kWeights = noise(2 * kParts * 16 * kChannels + 2 * kParts, 1);

// By definition: every input cell adds its 4 x 4 kernel at twice its place, less the padding; in double.
double transposed_convolution(const std::vector<float>& surface, int which, int part, int row, int column) {
  double sum = kWeights[size_t(2 * kParts * 16 * kChannels + which * kParts + part)];
  for (int y = 0; y < kSize; ++y) {
    for (int x = 0; x < kSize; ++x) {
      const int ky = row - 2 * y + 1, kx = column - 2 * x + 1;
      if (ky < 0 || ky >= 4 || kx < 0 || kx >= 4) continue;
      for (int c = 0; c < kChannels; ++c) {
        sum += double(surface[size_t((y * kSize + x) * kChannels + c)]) *
               double(kWeights[size_t((((which * kParts + part) * 4 + ky) * 4 + kx) * kChannels + c)]);
      }
    }
  }
  return sum;
}

TEST(ChartPredictor, EqualsTheTransposedConvolutionAtEveryCellForOnePersonAfterAnother) {
  maq::ChartPredictor charts(bytes_of(kWeights), kParts, "charts.f32");
  ASSERT_EQ(charts.channels(), kChannels);
  for (const unsigned person : {2u, 3u}) {
    const std::vector<float> surface = noise(kChannels * kSize * kSize, person);
    charts.begin(surface.data(), kSize);
    for (int round = 0; round < 2; ++round) {  // computed, then remembered
      for (int row = 0; row < 2 * kSize; ++row) {
        for (int column = 0; column < 2 * kSize; ++column) {
          const int part = (row + column) % kParts;
          const maq::ChartPoint point = charts.at(part, row, column);
          ASSERT_NEAR(point.u, transposed_convolution(surface, 0, part, row, column), 1e-4);
          ASSERT_NEAR(point.v, transposed_convolution(surface, 1, part, row, column), 1e-4);
        }
      }
    }
  }
}

TEST(ChartPredictor, BytesThatAreNoWeightsAreRefused) {
  std::vector<uint8_t> bytes = bytes_of(kWeights);
  bytes.pop_back();
  expect_error(MAQ_ERROR_BAD_BUNDLE, "charts.f32 has", [&] { maq::ChartPredictor(bytes, kParts, "charts.f32"); });
  bytes.resize(bytes.size() - 3);
  expect_error(MAQ_ERROR_BAD_BUNDLE, "no weights for 5 parts",
               [&] { maq::ChartPredictor(bytes, kParts, "charts.f32"); });
  expect_error(MAQ_ERROR_BAD_BUNDLE, "0 bytes", [&] { maq::ChartPredictor({}, kParts, "charts.f32"); });
  std::vector<float> broken = kWeights;
  broken[7] = std::numeric_limits<float>::quiet_NaN();
  expect_error(MAQ_ERROR_BAD_BUNDLE, "not finite",
               [&] { maq::ChartPredictor(bytes_of(broken), kParts, "charts.f32"); });
}

}  // namespace
}  // namespace chart_predictor_tests
