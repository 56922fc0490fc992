// The whole image, upright, as the networks see it.
#include "densepose/detector/rotated_input.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace {

constexpr int kWidth = 640, kHeight = 480, kLongSide = 320;

maq::Point at(const maq::AffineMap& map, double x, double y) {
  return {map.xx * x + map.xy * y + map.shift_x, map.yx * x + map.yy * y + map.shift_y};
}

TEST(RotatedInput, WithoutRollItIsTheImageAtTheLongSide) {
  const maq::RotatedInput input = maq::rotated_input(kWidth, kHeight, kLongSide, 0);
  EXPECT_EQ(input.size.width_px, 320);
  EXPECT_EQ(input.size.height_px, 240);
  const maq::Point corner = at(input.to_image, 320, 240);
  EXPECT_DOUBLE_EQ(corner.x, kWidth);
  EXPECT_DOUBLE_EQ(corner.y, kHeight);
  EXPECT_DOUBLE_EQ(input.up.y, -1);
}

TEST(RotatedInput, AllOfTheImageLiesInItAtOneScaleAndUpIsUp) {
  for (int steps = -24; steps <= 24; ++steps) {
    if (steps == 0) continue;
    const maq::RotatedInput input = maq::rotated_input(kWidth, kHeight, kLongSide, steps);
    EXPECT_EQ(input.roll_steps, steps);
    EXPECT_NEAR(std::hypot(input.to_image.xx, input.to_image.yx), double(kWidth) / kLongSide, 1e-9);
    const maq::AffineMap to_input = input.to_image.inverse();
    double left = 1e9, top = 1e9, right = -1e9, bottom = -1e9;
    for (const auto& [x, y] : {std::pair{0, 0}, {kWidth, 0}, {0, kHeight}, {kWidth, kHeight}}) {
      const maq::Point corner = at(to_input, x, y);
      left = std::min(left, corner.x);
      top = std::min(top, corner.y);
      right = std::max(right, corner.x);
      bottom = std::max(bottom, corner.y);
    }
    EXPECT_TRUE(left > -1 && left < 1 && top > -1 && top < 1) << steps;
    EXPECT_NEAR(right, input.size.width_px, 1) << steps;
    EXPECT_NEAR(bottom, input.size.height_px, 1) << steps;
    // A world that is rotated clockwise by a quarter has what was above at the right.
    const double angle = steps * maq::kRollStepRad;
    EXPECT_NEAR(input.up.x, std::sin(angle), 1e-12);
    EXPECT_NEAR(input.up.y, -std::cos(angle), 1e-12);
    const maq::Point from = at(to_input, 320, 240), to = at(to_input, 320 + input.up.x, 240 + input.up.y);
    EXPECT_NEAR(to.x - from.x, 0, 1e-9) << steps;
    EXPECT_LT(to.y, from.y) << steps;
  }
}

TEST(RotatedInput, AQuarterTurnHasTheOtherSides) {
  const maq::RotatedInput input = maq::rotated_input(kWidth, kHeight, kLongSide, 6);
  EXPECT_EQ(input.size.width_px, 240);
  EXPECT_EQ(input.size.height_px, 320);
}

}  // namespace
