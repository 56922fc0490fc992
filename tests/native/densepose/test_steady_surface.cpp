#include "densepose/surface/steady_surface.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

namespace steady_surface_tests {
namespace {

constexpr int kSide = 64, kSize = 8, kCoarse = 2, kIndex = 3, kClasses = kCoarse + kIndex, kChannels = 3;
constexpr float kSteadiness = 0.8f;

// A person whose answer is the same in all cells, in a square image whose brightness rises to the right.
class SteadySurface : public ::testing::Test {
 protected:
  SteadySurface() : pixels_(size_t(kSide * kSide)) { show(0); }

  // Moves the image to the right.
  void show(int shift_px, int lighter = 0) {
    for (int y = 0; y < kSide; ++y)
      for (int x = 0; x < kSide; ++x)
        pixels_[size_t(y * kSide + x)] = uint8_t(40 + 2 * std::max(0, x - shift_px) + y % 7 + lighter);
  }

  // Shows the next frame; returns the logit of the second part in the middle of the person after it.
  float next(float second_part, double left_px = 0, bool follows_last = true) {
    begin(follows_last);
    fill(5, second_part);
    steady(left_px);
    return logits().cell(4, 4)[4];
  }

  void begin(bool follows_last) {
    maq::ImageView image{};
    image.format = MAQ_PIXEL_GREY8;
    image.width_px = image.height_px = kSide;
    image.planes[0] = {pixels_.data(), kSide};
    steady_.begin(image, follows_last);
  }

  void fill(float person, float second_part) {
    labels_.clear();
    for (int cell = 0; cell < kSize * kSize; ++cell) labels_.insert(labels_.end(), {0, person, 0, 0, second_part});
    surface_.assign(size_t(kSize * kSize / 4 * kChannels), second_part);
  }

  void steady(double left_px, double width_px = kSide) {
    maq::AffineMap to_cells;
    to_cells.xx = kSize / width_px, to_cells.yy = double(kSize) / kSide;
    to_cells.shift_x = -left_px * to_cells.xx;
    steady_.steady(to_cells, logits(), labels_.data(), surface_.data(), kChannels);
  }

  maq::DenseLogits logits() const { return {labels_.data(), nullptr, kCoarse, kIndex, kSize}; }

  std::vector<uint8_t> pixels_;
  std::vector<float> labels_, surface_;
  maq::SteadySurface steady_{kSteadiness};
};

TEST_F(SteadySurface, AnswersOfAStillPersonAreAveraged) {
  EXPECT_FLOAT_EQ(next(1), 1);
  EXPECT_FLOAT_EQ(next(-1), kSteadiness - (1 - kSteadiness));
  EXPECT_FLOAT_EQ(surface_[3 * kChannels], kSteadiness - (1 - kSteadiness));
  for (int k = 0; k < 40; ++k) next(-1);
  EXPECT_NEAR(next(-1), -1, 1e-3);
}

TEST_F(SteadySurface, ANewStreamBeginsAnew) {
  next(1);
  EXPECT_FLOAT_EQ(next(-1, 0, false), -1);
}

TEST_F(SteadySurface, APersonWhoWasNotThereBeforeIsNotMixed) {
  next(1);
  begin(true);  // nobody in this frame
  begin(true);
  fill(5, -1);
  steady(0);
  EXPECT_FLOAT_EQ(labels_[4], -1);
}

TEST_F(SteadySurface, AViewFarAwayOrOfAnotherScaleIsAnotherPersons) {
  for (const auto& [left_px, width_px] : {std::pair{30.0, 64.0}, {0.0, 30.0}, {0.0, 160.0}}) {
    next(1, 0, false);
    begin(true);
    fill(5, -1);
    steady(left_px, width_px);
    EXPECT_FLOAT_EQ(logits().cell(4, 4)[4], -1);
  }
}

TEST_F(SteadySurface, TheAnswerMovesWithTheImage) {
  show(0);
  begin(false);
  fill(5, 0);
  for (int row = 0; row < kSize; ++row)  // the left half has the second part
    for (int column = 0; column < kSize / 2; ++column)
      labels_[size_t(logits().cell(row, column) - labels_.data()) + 4] = 4;
  steady(0);
  show(8);  // by one cell
  begin(true);
  fill(5, 0);
  steady(0);
  EXPECT_NEAR(logits().cell(3, 4)[4], kSteadiness * 4, 0.5);
  EXPECT_NEAR(logits().cell(3, 5)[4], 0, 0.5);
}

TEST_F(SteadySurface, WhereTheImageOrTheOutlineChangesTheNewAnswerCounts) {
  next(1);
  show(0, 90);
  EXPECT_LT(next(-1), -0.95f);
  next(1, 0, false);
  begin(true);
  fill(-25, -1);  // nobody any more
  steady(0);
  EXPECT_LT(logits().cell(4, 4)[4], -0.95f);
}

TEST_F(SteadySurface, NanOfOneFrameIsGoneInTheNext) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  next(nan);
  EXPECT_FLOAT_EQ(next(1), 1);
  begin(true);
  fill(nan, 1);
  steady(0);
  for (int k = 0; k < 2; ++k) EXPECT_TRUE(std::isfinite(next(1)));
  EXPECT_TRUE(std::isfinite(labels_[1]));
}

TEST_F(SteadySurface, WithoutSteadinessNothingIsMixed) {
  steady_ = maq::SteadySurface(0);
  next(1);
  EXPECT_FLOAT_EQ(next(-1), -1);
}

}  // namespace
}  // namespace steady_surface_tests
