// The sizes of boxes that are seen, and of none that are not.
#include <gtest/gtest.h>

#include "edges/curves/curve_extractor.h"
#include "edges/measuring/boxes.h"
#include "support/samples/analytic_scenes.h"

namespace {

using namespace maq::test;
using maq::BoxFinder;
using maq::CurveExtractor;
using maq::MeasuredBox;

std::vector<MeasuredBox> boxes_of(const SeenScene& seen) {
  CurveExtractor extractor;
  std::vector<MeasuredBox> found;
  BoxFinder().find(seen.field, extractor.extract(seen.field), found);
  return found;
}

// The worst error of the box that is nearest to these sizes, metres.
double worst_error(const std::vector<MeasuredBox>& boxes, double length, double width, double height) {
  double best = INFINITY;
  for (const MeasuredBox& box : boxes) {
    best = std::min(best, std::max({std::abs(box.size_m[0] - length), std::abs(box.size_m[1] - width),
                                    std::abs(box.size_m[2] - height)}));
  }
  return best;
}

TEST(Boxes, ABoxOfTheTrueFieldIsMeasuredWithinAMillimetre) {
  const auto boxes = boxes_of(see(lone_box(), camera_of(320, 240, 300)));
  ASSERT_EQ(boxes.size(), 1u);
  EXPECT_LE(worst_error(boxes, 0.5, 0.36, 0.3), 1e-3);
  EXPECT_GE(boxes[0].corners, 6);  // of the 7 that are seen
  for (size_t k = 0; k < 3; ++k) {
    EXPECT_GT(boxes[0].size_tolerance_m[k], 0);
    EXPECT_LT(boxes[0].size_tolerance_m[k], 5e-3);
    EXPECT_NEAR(maq::dot(boxes[0].axis[k], boxes[0].axis[(k + 1) % 3]), 0, 1e-6);
  }
}

TEST(Boxes, TheToleranceIncludesTheFocalLengthAcrossTheOpticalAxisAlone) {
  const SeenScene seen = see(lone_box(), camera_of(320, 240, 300));
  CurveExtractor extractor;
  const auto& curves = extractor.extract(seen.field);
  std::vector<MeasuredBox> exact, uncertain;
  BoxFinder().find(seen.field, curves, exact);
  BoxFinder().find(seen.field, curves, uncertain, 0.02);
  ASSERT_EQ(uncertain.size(), 1u);
  for (size_t k = 0; k < 3; ++k) {
    const double across = 1 - exact[0].axis[k].z * exact[0].axis[k].z;
    EXPECT_NEAR(std::pow(uncertain[0].size_tolerance_m[k], 2),
                std::pow(exact[0].size_tolerance_m[k], 2) + std::pow(0.02 * across * exact[0].size_m[k], 2), 1e-12);
    EXPECT_EQ(uncertain[0].size_m[k], exact[0].size_m[k]);
  }
}

TEST(Boxes, NoiseBlurAndSmearedDepthCostAFewMillimetres) {
  for (const unsigned seed : {1u, 2u, 3u, 4u}) {
    SeenScene seen = see(lone_box(), camera_of(640, 480, 600));
    damage(seen, {0.5, 0.5, false, 3, 0.2}, seed);
    const auto boxes = boxes_of(seen);
    ASSERT_GE(boxes.size(), 1u) << seed;
    EXPECT_LE(worst_error(boxes, 0.5, 0.36, 0.3), 8e-3) << seed;
  }
}

TEST(Boxes, StackedBoxesAreTwo) {
  const auto boxes = boxes_of(see(stacked_boxes(), camera_of(640, 480, 600)));
  EXPECT_LE(worst_error(boxes, 0.6, 0.5, 0.3), 4e-3);
  EXPECT_LE(worst_error(boxes, 0.35, 0.3, 0.25), 4e-3);
  EXPECT_EQ(boxes.size(), 2u);
}

TEST(Boxes, ACylinderIsNone) { EXPECT_TRUE(boxes_of(see(standing_cylinder(), camera_of(320, 240, 300))).empty()); }

TEST(Boxes, NoCurvesHaveNoBoxes) {
  std::vector<MeasuredBox> found(3);
  BoxFinder().find(maq::EdgeField(), maq::EdgeCurves(), found);
  EXPECT_TRUE(found.empty());
}

}  // namespace
