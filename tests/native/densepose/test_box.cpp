#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "densepose/detector/box.h"

namespace {

using maq::Box;
using maq::ScoredBox;

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr std::array<float, 4> kUnit = {1, 1, 1, 1};

// The definition of greedy NMS, with no shortcut: repeatedly take the best of what is left.
std::vector<ScoredBox> reference_nms(std::vector<ScoredBox> left, double iou) {
  std::vector<ScoredBox> kept;
  while (!left.empty()) {
    size_t best = 0;
    for (size_t i = 1; i < left.size(); ++i) {
      const bool better =
          left[i].score > left[best].score || (left[i].score == left[best].score && left[i].index < left[best].index);
      if (better) best = i;
    }
    const ScoredBox chosen = left[best];
    kept.push_back(chosen);
    std::vector<ScoredBox> rest;
    for (size_t i = 0; i < left.size(); ++i) {
      if (i == best) continue;
      const Box &a = chosen.box, &b = left[i].box;
      const double w = std::max(0.0, double(std::min(a.x1, b.x1)) - double(std::max(a.x0, b.x0)));
      const double h = std::max(0.0, double(std::min(a.y1, b.y1)) - double(std::max(a.y0, b.y0)));
      const double area_a = (double(a.x1) - a.x0) * (double(a.y1) - a.y0);
      const double area_b = (double(b.x1) - b.x0) * (double(b.y1) - b.y0);
      if (w * h / (area_a + area_b - w * h) <= iou) rest.push_back(left[i]);
    }
    left = rest;
  }
  return kept;
}

std::vector<ScoredBox> suppressed(std::vector<ScoredBox> boxes, float iou, size_t limit) {
  maq::non_maximum_suppression(boxes, iou, limit);
  return boxes;
}

TEST(Box, DeltasMoveByWidthsAndGrowByLogarithms) {
  const float deltas[] = {1, -2, std::log(2.0f), std::log(0.5f)};
  const Box box = maq::apply_deltas({10, 20, 30, 60}, deltas, {10, 10, 1, 1});
  EXPECT_NEAR(box.x0, 22 - 20, 1e-4);  // centre 20 + 0.1 * 20, width 40
  EXPECT_NEAR(box.x1, 22 + 20, 1e-4);
  EXPECT_NEAR(box.y0, 32 - 10, 1e-4);  // centre 40 - 0.2 * 40, height 20
  EXPECT_NEAR(box.y1, 32 + 10, 1e-4);
}

TEST(Box, ExtremeDeltasAreClampedAndStayFinite) {
  const float growing[] = {0, 0, 1e4f, kInfinity};
  const Box grown = maq::apply_deltas({0, 0, 16, 16}, growing, kUnit);
  EXPECT_NEAR(grown.width(), 1000, 1e-2);
  EXPECT_NEAR(grown.height(), 1000, 1e-2);
  const float shrinking[] = {0, 0, -1e4f, -1e4f};
  Box shrunk = maq::apply_deltas({0, 0, 16, 16}, shrinking, kUnit);
  EXPECT_FALSE(clip_box(shrunk, 100, 100)) << "a box of no size has no area";
  const float flying[] = {1e4f, -1e4f, 0, 0};
  Box flown = maq::apply_deltas({0, 0, 16, 16}, flying, kUnit);
  EXPECT_TRUE(std::isfinite(flown.x0) && std::isfinite(flown.y1));
  EXPECT_FALSE(clip_box(flown, 100, 100));
}

TEST(Box, NanIsDroppedByClippingInEveryPlace) {
  for (int place = 0; place < 4; ++place) {
    float deltas[] = {0, 0, 0, 0};
    deltas[place] = std::nanf("");
    Box box = maq::apply_deltas({10, 10, 20, 20}, deltas, kUnit);
    EXPECT_FALSE(clip_box(box, 100, 100)) << "delta " << place;
  }
}

TEST(Box, ClippingKeepsBoxesInsideAndDropsEmptyAndReversedOnes) {
  Box over{-5, -5, 500, 20};
  ASSERT_TRUE(clip_box(over, 100, 50));
  EXPECT_EQ(over.x0, 0);
  EXPECT_EQ(over.x1, 100);
  EXPECT_EQ(over.y1, 20);
  Box empty{10, 10, 10, 20}, reversed{20, 20, 10, 10}, outside{200, 0, 300, 10};
  EXPECT_FALSE(clip_box(empty, 100, 50));
  EXPECT_FALSE(clip_box(reversed, 100, 50));
  EXPECT_FALSE(clip_box(outside, 100, 50));
}

TEST(Box, OverlapIsIntersectionOverUnion) {
  EXPECT_FLOAT_EQ(maq::overlap({0, 0, 10, 10}, {0, 0, 10, 10}), 1);
  EXPECT_FLOAT_EQ(maq::overlap({0, 0, 10, 10}, {5, 0, 15, 10}), 1.0f / 3);
  EXPECT_EQ(maq::overlap({0, 0, 10, 10}, {10, 0, 20, 10}), 0) << "touching is not overlapping";
  EXPECT_EQ(maq::overlap({0, 0, 0, 0}, {0, 0, 0, 0}), 0);
}

TEST(Box, EqualScoresAreTakenByLowestIndex) {
  const std::vector<ScoredBox> same = {{{0, 0, 10, 10}, 0.5f, 3}, {{0, 0, 10, 10}, 0.5f, 1}, {{1, 0, 11, 10}, 0.5f, 2}};
  const auto kept = suppressed(same, 0.5f, 10);
  ASSERT_EQ(kept.size(), 1u);
  EXPECT_EQ(kept[0].index, 1);
}

TEST(Box, SuppressionNeedsMoreThanTheThreshold) {
  // Overlap is exactly one half: 10 of 20.
  const std::vector<ScoredBox> boxes = {{{0, 0, 10, 2}, 0.9f, 0}, {{0, 0, 10, 1}, 0.8f, 1}};
  EXPECT_EQ(suppressed(boxes, 0.5f, 10).size(), 2u);
  EXPECT_EQ(suppressed(boxes, 0.49f, 10).size(), 1u);
}

TEST(Box, SuppressionEqualsTheReferenceOnRandomBoxesWithTies) {
  std::mt19937 random(7);
  for (int round = 0; round < 50; ++round) {
    std::vector<ScoredBox> boxes;
    for (int i = 0; i < 80; ++i) {
      const float x = float(random() % 60), y = float(random() % 60);
      boxes.push_back({{x, y, x + 5 + float(random() % 40), y + 5 + float(random() % 40)}, float(random() % 8) / 8, i});
    }
    const auto expected = reference_nms(boxes, 0.7);
    std::shuffle(boxes.begin(), boxes.end(), random);
    const auto kept = suppressed(boxes, 0.7f, 1000);
    ASSERT_EQ(kept.size(), expected.size());
    for (size_t i = 0; i < kept.size(); ++i) EXPECT_EQ(kept[i].index, expected[i].index);
    const auto limited = suppressed(boxes, 0.7f, 5);
    ASSERT_EQ(limited.size(), 5u);
    for (size_t i = 0; i < 5; ++i) EXPECT_EQ(limited[i].index, expected[i].index);
  }
}

}  // namespace
