// Keypoints from logits, compared with the definition.
#include "densepose/keypoints/keypoint_decode.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <vector>

namespace keypoint_decode_tests {
namespace {

constexpr int kSize = 64;
constexpr float kNaN = std::numeric_limits<float>::quiet_NaN(), kInfinity = std::numeric_limits<float>::infinity();

// Logits by keypoint, row and column, and how the network lays them out.
class KeypointLogits {
 public:
  explicit KeypointLogits(float value = 0) : values_(size_t(kSize * kSize) * maq::kKeypoints, value) {}
  float& at(size_t keypoint, int row, int column) {
    const size_t four = size_t(row / 2) * size_t(kSize / 2) + size_t(column / 2);
    return values_[(4 * four + size_t(row % 2 * 2 + column % 2)) * maq::kKeypoints + keypoint];
  }
  maq::Keypoints decoded(const maq::AffineMap& to_image = {}) const {
    return maq::decode_keypoints(values_.data(), kSize, to_image);
  }

 private:
  std::vector<float> values_;
};

// The definition in float64, over all cells.
maq::Keypoint expected_keypoint(KeypointLogits& logits, size_t k) {
  int row = 0, column = 0;
  for (int y = 0; y < kSize; ++y) {
    for (int x = 0; x < kSize; ++x) {
      if (logits.at(k, y, x) > logits.at(k, row, column)) row = y, column = x;
    }
  }
  double all = 0, near = 0, sum_x = 0, sum_y = 0;
  for (int y = 0; y < kSize; ++y) {
    for (int x = 0; x < kSize; ++x) {
      const double odds = std::exp(double(logits.at(k, y, x)) - double(logits.at(k, row, column)));
      all += odds;
      if (std::abs(y - row) > 2 || std::abs(x - column) > 2) continue;
      near += odds;
      sum_x += odds * (x + 0.5);
      sum_y += odds * (y + 0.5);
    }
  }
  return {float(sum_x / near), float(sum_y / near), float(near / all)};
}

TEST(KeypointDecode, EqualsItsDefinitionOnRandomLogits) {
  std::mt19937 random(7);
  std::normal_distribution<float> normal(0, 6);
  KeypointLogits logits;
  for (size_t k = 0; k < maq::kKeypoints; ++k) {
    for (int i = 0; i < kSize * kSize; ++i) logits.at(k, i / kSize, i % kSize) = normal(random);
  }
  const maq::Keypoints found = logits.decoded();
  for (size_t k = 0; k < maq::kKeypoints; ++k) {
    const maq::Keypoint expected = expected_keypoint(logits, k);
    EXPECT_NEAR(found[k].x_px, expected.x_px, 1e-4) << k;
    EXPECT_NEAR(found[k].y_px, expected.y_px, 1e-4) << k;
    EXPECT_NEAR(found[k].confidence, expected.confidence, 1e-3) << k;
  }
}

TEST(KeypointDecode, APeakBetweenTwoCellsLiesBetweenThem) {
  KeypointLogits logits(-20);
  logits.at(5, 10, 20) = logits.at(5, 10, 21) = 5;
  const maq::Keypoint found = logits.decoded({2, 0, 100, 0, 4, 50})[5];
  EXPECT_NEAR(found.x_px, 100 + 2 * 21, 1e-3);
  EXPECT_NEAR(found.y_px, 50 + 4 * 10.5, 1e-3);
  EXPECT_NEAR(found.confidence, 1, 1e-3);
}

TEST(KeypointDecode, AKeypointThatIsNowhereHasLowConfidence) {
  const maq::Keypoints found = KeypointLogits().decoded();
  EXPECT_NEAR(found[0].confidence, 9.0 / (kSize * kSize), 1e-5) << "the first cell, with its neighbours in the image";
  EXPECT_EQ(found[0].x_px, 1.5f);
}

TEST(KeypointDecode, CornersAndRotationsAreMappedExactly) {
  KeypointLogits logits(-100);
  logits.at(0, 0, 0) = logits.at(1, kSize - 1, kSize - 1) = 0;
  const maq::Keypoints found = logits.decoded({0, -1, 64, 1, 0, 0});  // a quarter turn
  EXPECT_NEAR(found[0].x_px, 63.5, 1e-4);
  EXPECT_NEAR(found[0].y_px, 0.5, 1e-4);
  EXPECT_NEAR(found[1].x_px, 0.5, 1e-4);
  EXPECT_NEAR(found[1].y_px, 63.5, 1e-4);
}

TEST(KeypointDecode, LogitsThatAreNotFiniteGiveNoConfidence) {
  for (const float value : {kNaN, kInfinity, -kInfinity}) {
    const maq::Keypoint found = KeypointLogits(value).decoded()[3];
    EXPECT_EQ(found.confidence, 0) << value;
    EXPECT_EQ(found.x_px, kSize / 2) << value;
  }
  // One bad cell beside the peak spoils nothing.
  for (const float value : {kNaN, -kInfinity}) {
    KeypointLogits logits(-20);
    logits.at(2, 30, 30) = 5;
    logits.at(2, 30, 31) = value;
    const maq::Keypoint found = logits.decoded()[2];
    EXPECT_NEAR(found.x_px, 30.5, 1e-3) << value;
    EXPECT_GT(found.confidence, 0.99f) << value;
  }
  KeypointLogits huge(3e38f);
  huge.at(0, 4, 4) = -3e38f;
  EXPECT_TRUE(std::isfinite(huge.decoded()[0].confidence));
}

}  // namespace
}  // namespace keypoint_decode_tests
