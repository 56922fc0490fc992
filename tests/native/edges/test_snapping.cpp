// A pointer near a corner, an edge or on a face of a box gets that.
#include <gtest/gtest.h>

#include "edges/curves/curve_extractor.h"
#include "edges/measuring/snap.h"
#include "support/samples/analytic_scenes.h"

namespace {

using namespace maq::test;
using maq::Snap;
using maq::snap_to;
using maq::SnapTarget;
using maq::Vec3;

class Snapping : public ::testing::Test {
 protected:
  Snapping() : seen_(see(lone_box(), camera_of(320, 240, 300))), curves_(extractor_.extract(seen_.field)) {}

  SeenScene seen_;
  maq::CurveExtractor extractor_;
  const maq::EdgeCurves& curves_;
};

TEST_F(Snapping, TheNearestCornerComesFirst) {
  for (size_t i = 0; i < curves_.corners.size(); ++i) {
    const Vec3 p = curves_.corners[i].point;
    const double x = 300 * p.x / p.z + 159.5, y = 300 * p.y / p.z + 119.5;
    const Snap snap = snap_to(seen_.field, curves_, x + 2, y - 1);
    EXPECT_EQ(snap.target, SnapTarget::kCorner);
    EXPECT_EQ(snap.index, int(i));
    EXPECT_NEAR(snap.distance_px, std::sqrt(5.0), 1e-9);
  }
}

TEST_F(Snapping, AwayFromCornersAnEdgeIsFoundAtItsPoint) {
  for (size_t i = 0; i < curves_.curves.size(); ++i) {
    const maq::EdgeCurve& curve = curves_.curves[i];
    const Vec3* ends = &curves_.points[size_t(curve.first_point)];
    const Vec3 middle = 0.5 * (ends[0] + ends[1]);
    const double x = 300 * middle.x / middle.z + 159.5, y = 300 * middle.y / middle.z + 119.5;
    const Snap snap = snap_to(seen_.field, curves_, x, y);
    EXPECT_EQ(snap.target, SnapTarget::kEdge);
    EXPECT_EQ(snap.index, int(i));
    EXPECT_LT(maq::length(snap.point - middle), 1e-9);
  }
}

TEST_F(Snapping, AFaceIsThePlaneBesideAnEdge) {
  const Snap snap = snap_to(seen_.field, curves_, 190, 145);  // the broad side
  ASSERT_EQ(snap.target, SnapTarget::kPlane);
  const float depth = seen_.field.depth_m[145 * 320 + 190];
  EXPECT_NEAR(snap.point.z, double(depth), 1e-4);
  EXPECT_NEAR(300 * snap.point.x / snap.point.z + 159.5, 190, 1e-9);
}

TEST_F(Snapping, BesideTheBoxAndOutsideThePictureIsNothing) {
  EXPECT_EQ(snap_to(seen_.field, curves_, 20, 20).target, SnapTarget::kNothing);
  EXPECT_EQ(snap_to(seen_.field, curves_, 1e9, -1e9).target, SnapTarget::kNothing);
  EXPECT_EQ(snap_to(seen_.field, curves_, NAN, 3).target, SnapTarget::kNothing);
}

TEST_F(Snapping, ARayFromElsewhereHitsTheFaceThatItMeetsFirst) {
  const Snap seen = snap_to(seen_.field, curves_, 190, 145);
  ASSERT_EQ(seen.target, SnapTarget::kPlane);
  const Vec3 from{0.3, -0.4, 0.2};
  const Snap hit = maq::snap_to_ray(seen_.field, curves_, from, 5.0 * (seen.point - from), 0.001);
  ASSERT_EQ(hit.target, SnapTarget::kPlane);
  EXPECT_LT(maq::length(hit.point - seen.point), 0.002);
  EXPECT_EQ(maq::snap_to_ray(seen_.field, curves_, from, from - seen.point, 0.001).target, SnapTarget::kNothing);
  maq::EdgeField without_depth = seen_.field;
  without_depth.depth_m.clear();
  EXPECT_EQ(maq::snap_to_ray(without_depth, curves_, from, seen.point - from, 0.001).target, SnapTarget::kNothing);
}

TEST_F(Snapping, AnAngleIsMeasuredAtTheOriginOfTheRay) {
  const Vec3 corner = curves_.corners[0].point, ahead = maq::normalized(corner);
  const Vec3 beside = corner + 0.02 * maq::any_orthogonal(ahead);
  for (const double back : {0.0, 1.0}) {
    const Vec3 from = -back * ahead;
    const double angle = std::atan2(0.02, maq::length(corner - from));
    EXPECT_NEAR(maq::snap_to_ray(seen_.field, curves_, from, beside - from, angle + 1e-6).angle_rad, angle, 1e-9);
    EXPECT_NE(maq::snap_to_ray(seen_.field, curves_, from, beside - from, angle - 1e-6).target, SnapTarget::kCorner);
  }
}

}  // namespace
