// The sizes of boxes that are seen, and of none that are not.
#include <gtest/gtest.h>

#include "edges/measuring/boxes.h"
#include "support/samples/analytic_scenes.h"

namespace {

using namespace maq::test;
using maq::BoxFinder;
using maq::MeasuredBox;
using maq::Vec3;

std::vector<MeasuredBox> boxes_of(const maq::EdgeField& field) {
  std::vector<MeasuredBox> found;
  BoxFinder().find(field, found);
  return found;
}

std::vector<MeasuredBox> boxes_of(const SeenScene& seen) { return boxes_of(seen.field); }

// The worst error of the box that is nearest to these sizes, metres.
double worst_error(const std::vector<MeasuredBox>& boxes, double length, double width, double height) {
  double best = INFINITY;
  for (const MeasuredBox& box : boxes) {
    best = std::min(best, std::max({std::abs(box.size_m[0] - length), std::abs(box.size_m[1] - width),
                                    std::abs(box.size_m[2] - height)}));
  }
  return best;
}

// Depth alone: without a network, no pixel is known to be near an edge.
maq::EdgeField depth_frame(int width, int height, double focal_px, float depth_m) {
  maq::EdgeField field;
  field.width = width, field.height = height;
  field.intrinsics = camera_of(width, height, focal_px);
  field.depth_m.assign(size_t(width) * size_t(height), depth_m);
  return field;
}

SolidScene box_of(Vec3 size, double turn_rad, Vec3 from) {
  SolidScene scene;
  const int floor = add_floor(scene);
  scene.add_box({0, 0, 0}, size, turn_rad, floor);
  scene.seen_from(from, {0, 0, size.z / 2});
  return scene;
}

// 500 x 360 x 300 mm, a metre away, with three faces towards the camera.
SolidScene carton() { return box_of({0.5, 0.36, 0.3}, 0.6, {0.1, -1.1, 0.75}); }

// Removes depth in the columns [from, to).
void hide_columns(maq::EdgeField& field, int from, int to, float depth_m) {
  for (int y = 0; y < field.height; ++y) {
    for (int x = from; x < to; ++x) field.depth_m[size_t(y) * size_t(field.width) + size_t(x)] = depth_m;
  }
}

TEST(Boxes, ABoxOfExactDepthIsMeasuredWithinAMillimetre) {
  const auto boxes = boxes_of(see(carton(), camera_of(320, 240, 300)));
  ASSERT_EQ(boxes.size(), 1u);
  EXPECT_LE(worst_error(boxes, 0.5, 0.36, 0.3), 1e-3);
  EXPECT_GE(boxes[0].corners, 6);  // of the 7 that are seen
  for (size_t k = 0; k < 3; ++k) {
    EXPECT_GT(boxes[0].size_tolerance_m[k], 0);
    EXPECT_LT(boxes[0].size_tolerance_m[k], 8e-3);
    EXPECT_NEAR(maq::dot(boxes[0].axis[k], boxes[0].axis[(k + 1) % 3]), 0, 1e-6);
  }
}

TEST(Boxes, TheToleranceIncludesTheFocalLengthAcrossTheOpticalAxisAlone) {
  const SeenScene seen = see(carton(), camera_of(320, 240, 300));
  std::vector<MeasuredBox> exact, uncertain;
  BoxFinder().find(seen.field, exact);
  BoxFinder().find(seen.field, uncertain, 0.02);
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
    SeenScene seen = see(carton(), camera_of(640, 480, 600));
    damage(seen, {0.5, 0.5, false, 1, 0.2}, seed);
    const auto boxes = boxes_of(seen);
    ASSERT_GE(boxes.size(), 1u) << seed;
    EXPECT_LE(worst_error(boxes, 0.5, 0.36, 0.3), 8e-3) << seed;
  }
}

TEST(Boxes, TheStepsOfStructuredLightCostAFewMillimetres) {
  SeenScene seen = see(carton(), camera_of(640, 480, 525));
  for (float& depth : seen.field.depth_m) {
    if (depth > 0) depth = float(1 / (std::round(1 / double(depth) / 0.0028) * 0.0028));
  }
  const auto boxes = boxes_of(seen);
  ASSERT_EQ(boxes.size(), 1u);
  EXPECT_LE(worst_error(boxes, 0.5, 0.36, 0.3), 5e-3);
}

// The front edge has one direction, and the height is that of the top above the floor.
TEST(Boxes, OneFaceAboveTheFloorIsEnough) {
  const auto boxes = boxes_of(see(box_of({0.3, 0.2, 0.1}, 0.3, {0, -0.02, 1.2}), camera_of(640, 480, 600)));
  ASSERT_EQ(boxes.size(), 1u);
  EXPECT_LE(worst_error(boxes, 0.3, 0.2, 0.1), 2e-3);
  EXPECT_EQ(boxes[0].corners, 4);
}

TEST(Boxes, StackedBoxesAreTwo) {
  const auto boxes = boxes_of(see(stacked_boxes(), camera_of(640, 480, 600)));
  EXPECT_LE(worst_error(boxes, 0.6, 0.5, 0.3), 4e-3);
  EXPECT_LE(worst_error(boxes, 0.35, 0.3, 0.25), 4e-3);
  EXPECT_EQ(boxes.size(), 2u);
}

TEST(Boxes, ACylinderIsNone) { EXPECT_TRUE(boxes_of(see(standing_cylinder(), camera_of(320, 240, 300))).empty()); }

// Nothing is known behind it: whether it ends there, or the sensor sees no more of it, is not known.
TEST(Boxes, ABoxBeforeUnknownDepthIsLeftOut) {
  EXPECT_TRUE(boxes_of(see(lone_box(), camera_of(320, 240, 300))).empty());
}

// A thing in front hides a side; the image or unknown depth cuts it off: the side could be anywhere.
TEST(Boxes, ABoxWithASideThatIsNotSeenIsLeftOut) {
  const SeenScene whole = see(carton(), camera_of(320, 240, 300));
  ASSERT_EQ(boxes_of(whole).size(), 1u);
  for (const float in_front : {0.0f, 0.3f}) {
    maq::EdgeField covered = whole.field;
    hide_columns(covered, 160, 320, in_front);
    EXPECT_TRUE(boxes_of(covered).empty()) << in_front;
  }
  maq::EdgeField cut = depth_frame(160, 240, 300, 0);
  for (int y = 0; y < 240; ++y) {
    std::copy_n(&whole.field.depth_m[size_t(y) * 320], 160, &cut.depth_m[size_t(y) * 160]);
  }
  cut.intrinsics.cx_px = whole.field.intrinsics.cx_px;
  EXPECT_TRUE(boxes_of(cut).empty());
}

TEST(Boxes, ATableTopIsNoBox) {
  SolidScene scene;
  add_floor(scene);
  scene.add_box({0, 0, 0.7}, {0.8, 0.6, 0.03}, 0.4, -1);  // without legs: the floor is seen below it
  scene.seen_from({-0.3, -2.0, 1.8}, {0, 0, 0.6});
  for (const MeasuredBox& box : boxes_of(see(scene, camera_of(640, 480, 500)))) EXPECT_LT(box.size_m[2], 0.05);
}

TEST(Boxes, DepthWithoutABoxHasNone) {
  std::vector<MeasuredBox> found(3);
  BoxFinder().find(maq::EdgeField(), found);
  EXPECT_TRUE(found.empty());
  for (const float depth : {0.0f, 1.0f, 65.535f, 1e-30f, 1e30f, std::nanf(""), INFINITY, -1.0f}) {
    EXPECT_TRUE(boxes_of(depth_frame(64, 48, 60, depth)).empty()) << depth;
  }
  EXPECT_TRUE(boxes_of(depth_frame(1, 1, 60, 1)).empty());
  EXPECT_TRUE(boxes_of(depth_frame(401, 3, 60, 1)).empty());
}

TEST(Boxes, APlaneSeenEdgeOnHasNone) {
  SolidScene scene;
  add_floor(scene);
  for (const double height : {0.02, 0.3}) {
    scene = SolidScene();
    add_floor(scene);
    scene.seen_from({0, -1, height}, {0, 0, height - 0.01});
    EXPECT_TRUE(boxes_of(see(scene, camera_of(320, 240, 300))).empty()) << height;
  }
}

TEST(Boxes, ATinyBoxIsLeftOutAndOneThatFillsTheFrameIsToo) {
  EXPECT_TRUE(boxes_of(see(box_of({0.01, 0.01, 0.01}, 0.6, {0.1, -1.1, 0.75}), camera_of(320, 240, 300))).empty());
  EXPECT_TRUE(boxes_of(see(box_of({3, 3, 0.2}, 0.6, {0.1, -0.6, 0.75}), camera_of(320, 240, 300))).empty());
}

TEST(Boxes, OneFinderMeasuresFramesOfAnySizeAlike) {
  BoxFinder finder;
  std::vector<MeasuredBox> found;
  const SeenScene large = see(carton(), camera_of(640, 480, 600)), small = see(carton(), camera_of(320, 240, 300));
  finder.find(large.field, found);
  const auto first = found;
  finder.find(small.field, found);
  finder.find(large.field, found);
  ASSERT_EQ(found.size(), first.size());
  EXPECT_EQ(found[0].size_m, first[0].size_m);
}

}  // namespace
