// Neighbours of photos and the range of their depth, from points.
#include <gtest/gtest.h>

#include "scene/stereo/view_selection.h"
#include "support/samples/textured_scene.h"

namespace {

using maq::PinholeCamera;
using maq::plan_views;
using maq::ViewPlan;
using textured_scene::camera_at;
using textured_scene::turned;

// A wall 3 to 4 units away.
maq::PointCloud wall() {
  maq::PointCloud cloud;
  for (int i = 0; i < 900; ++i) cloud.add(-1 + i % 30 / 15.0, -1 + i / 30 / 15.0, 3 + i % 30 / 30.0);
  return cloud;
}

TEST(ViewSelection, TheBestNeighbourSeesTheSameFromSomeDegreesAside) {
  std::vector<PinholeCamera> cameras;
  for (const double x : {0.0, 0.05, 0.6, 2.5}) cameras.push_back(camera_at({x, 0, 0}));
  cameras.push_back(turned(camera_at({0.6, 0, 0}), 3.14159265));  // looks away
  const maq::PointCloud cloud = wall();
  const std::vector<ViewPlan> plans = plan_views(cameras, cloud.positions(), 8);
  ASSERT_GE(plans[0].neighbours.size(), 2u);
  EXPECT_EQ(plans[0].neighbours[0], 2u);
  EXPECT_EQ(plans[0].neighbours[1], 1u);
  EXPECT_TRUE(plans[0].has_depth());
  EXPECT_FALSE(plans[4].has_depth());
  for (const ViewPlan& plan : plans) EXPECT_EQ(std::count(plan.neighbours.begin(), plan.neighbours.end(), 4u), 0);
  EXPECT_EQ(plan_views(cameras, cloud.positions(), 1)[0].neighbours.size(), 1u);
}

TEST(ViewSelection, NearAndFarEncloseThePointsButStrayOnes) {
  maq::PointCloud cloud = wall();
  cloud.add(0, 0, 0.01);
  cloud.add(0, 0, 500);
  const std::vector<PinholeCamera> cameras = {camera_at({0, 0, 0}), camera_at({0.5, 0, 0})};
  const ViewPlan plan = plan_views(cameras, cloud.positions(), 4)[0];
  EXPECT_NEAR(plan.near, 0.9 * 3, 0.1);
  EXPECT_NEAR(plan.far, 1.1 * 4, 0.1);
}

TEST(ViewSelection, PhotosFromOnePlaceAndPhotosWithFewPointsHaveNoNeighbours) {
  const std::vector<PinholeCamera> cameras = {camera_at({0, 0, 0}), turned(camera_at({0, 0, 0}), 0.1)};
  EXPECT_FALSE(plan_views(cameras, wall().positions(), 4)[0].has_depth());
  maq::PointCloud few;
  for (int i = 0; i < 11; ++i) few.add(0.1 * i, 0, 3);
  const std::vector<PinholeCamera> apart = {camera_at({0, 0, 0}), camera_at({0.5, 0, 0})};
  EXPECT_FALSE(plan_views(apart, few.positions(), 4)[0].has_depth());
  EXPECT_FALSE(plan_views(apart, maq::PointCloud().positions(), 4)[1].has_depth());
  EXPECT_FALSE(plan_views({camera_at({0, 0, 0})}, wall().positions(), 4)[0].has_depth());
  EXPECT_TRUE(plan_views({}, wall().positions(), 4).empty());
}

}  // namespace
