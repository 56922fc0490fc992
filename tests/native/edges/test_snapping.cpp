// A pointer near a corner, an edge or on a face of a box gets that.
#include <gtest/gtest.h>

#include "edges/curves/curve_extractor.h"
#include "edges/measuring/snap.h"
#include "support/analytic_scenes.h"

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

}  // namespace
