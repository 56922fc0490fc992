// Which points of a cloud are visible, against a projection in long double, over the extreme cases of geometry.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "support/samples/front_points.h"
#include "support/samples/synthetic_scene.h"

namespace {

using maq::PinholeCamera;
using Position = std::array<double, 3>;

struct Cloud {
  std::vector<float> x, y, z;
  Position origin = {0, 0, 0};
  // In the world: what float keeps of it.
  void add(const Position& position) {
    x.push_back(float(position[0] - origin[0]));
    y.push_back(float(position[1] - origin[1]));
    z.push_back(float(position[2] - origin[2]));
  }
  maq::PointPositions positions() const { return {x.data(), y.data(), z.data(), x.size(), origin}; }
};

struct Projected {
  long double column, row, depth;
};
Projected reference(const Cloud& cloud, size_t i, const PinholeCamera& camera) {
  const long double d[3] = {cloud.x[i] + (long double)(cloud.origin[0]) - camera.centre[0],
                            cloud.y[i] + (long double)(cloud.origin[1]) - camera.centre[1],
                            cloud.z[i] + (long double)(cloud.origin[2]) - camera.centre[2]};
  long double seen[3];
  for (size_t k = 0; k < 3; ++k) {
    seen[k] = camera.rotation[3 * k] * d[0] + camera.rotation[3 * k + 1] * d[1] + camera.rotation[3 * k + 2] * d[2];
  }
  return {seen[0] / seen[2] * camera.fx_px + camera.cx_px, seen[1] / seen[2] * camera.fy_px + camera.cy_px, seen[2]};
}

// Every point that the reference sees well inside of a pixel is visible there or behind the one that is; no other is.
void expect_as_reference(const Cloud& cloud, const PinholeCamera& camera, double near, double min_px = 0.01) {
  const FrontPoints visible(cloud.positions(), camera, near);
  ASSERT_EQ(visible.points.size(), size_t(camera.width_px) * size_t(camera.height_px));
  for (size_t i = 0; i < cloud.x.size(); ++i) {
    const Projected at = reference(cloud, i, camera);
    if (!(at.depth > near * 1.000001L)) continue;
    const long double column = std::floor(at.column + 0.5L), row = std::floor(at.row + 0.5L);
    const bool near_edge = std::abs(at.column + 0.5L - std::round(at.column + 0.5L)) < min_px ||
                           std::abs(at.row + 0.5L - std::round(at.row + 0.5L)) < min_px;
    if (near_edge || column < 0 || row < 0 || column >= camera.width_px || row >= camera.height_px) continue;
    const size_t pixel = size_t(row) * size_t(camera.width_px) + size_t(column);
    ASSERT_NE(visible.points[pixel], kNoPoint) << "point " << i;
    EXPECT_LE(visible.depths[pixel], at.depth * 1.00001L) << "point " << i;
  }
  for (size_t pixel = 0; pixel < visible.points.size(); ++pixel) {
    const uint32_t front = visible.points[pixel];
    if (front == kNoPoint) {
      EXPECT_TRUE(std::isinf(visible.depths[pixel]));
      continue;
    }
    ASSERT_LT(front, cloud.x.size());
    const Projected at = reference(cloud, front, camera);
    EXPECT_NEAR(double(at.column), double(pixel % size_t(camera.width_px)), 0.5 + min_px);
    EXPECT_NEAR(double(at.row), double(pixel / size_t(camera.width_px)), 0.5 + min_px);
    EXPECT_NEAR(double(visible.depths[pixel] / at.depth), 1, 1e-5);
  }
}

// Points around the camera, most of them ahead.
Cloud cloud_around(const PinholeCamera& camera, double units, const Position& origin, int count, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  Cloud cloud;
  cloud.origin = origin;
  for (int i = 0; i < count; ++i) {
    const double seen[3] = {normal(random), normal(random), 3 + normal(random) * 1.5};
    Position position = camera.centre;
    for (size_t k = 0; k < 3; ++k) {
      for (size_t j = 0; j < 3; ++j) position[k] += units * camera.rotation[3 * j + k] * seen[j];
    }
    cloud.add(position);
  }
  return cloud;
}

TEST(PointProjection, OfCamerasOfEveryKind) {
  unsigned seed = 0;
  for (const double degrees : {1.0, 30.0, 60.0, 120.0, 170.0}) {
    for (const auto& [width, height] : {std::pair(64, 48), std::pair(33, 61), std::pair(1, 1), std::pair(1, 50)}) {
      PinholeCamera camera = camera_of(width, height, degrees);
      camera.rotation = rotation_of(1, 0.3 * seed, -0.2, 0.5);
      camera.centre = {0.5, -2, 1.0 * seed};
      const Cloud cloud = cloud_around(camera, 1, {0, 0, 0}, 3000, ++seed);
      expect_as_reference(cloud, camera, 0.01);
      camera.fy_px *= 1.7;    // pixels that are not square
      camera.cx_px += width;  // a principal point outside of the image
      expect_as_reference(cloud, camera, 0.01);
    }
  }
}

TEST(PointProjection, OfScenesInAnyUnitAndFarFromTheOriginOfTheWorld) {
  for (const double units : {1e-3, 1.0, 1e6}) {
    for (const double away : {0.0, 1e6}) {
      PinholeCamera camera = camera_of(640, 480, 60);
      camera.rotation = rotation_of(0.7, 0.1, 0.4, -0.3);
      camera.centre = {away * units, -away * units, away * units};
      const Cloud cloud = cloud_around(camera, units, camera.centre, 5000, 7);
      expect_as_reference(cloud, camera, 0.01 * units);
    }
  }
}

TEST(PointProjection, AtBehindAndBesideTheCamera) {
  const PinholeCamera camera = camera_of(8, 8, 90);
  Cloud cloud;
  cloud.add({0, 0, 0});
  for (const double depth : {1e-6, -1e-6, 0.0, -3.0}) {
    cloud.add({0, 0, depth});
    cloud.add({1, 0, depth});
    cloud.add({1e30, 1e30, depth});
  }
  FrontPoints visible(cloud.positions(), camera, 0.01);
  for (const uint32_t front : visible.points) EXPECT_EQ(front, kNoPoint);
  visible = FrontPoints(cloud.positions(), camera, 0);
  for (const uint32_t front : visible.points) EXPECT_TRUE(front == kNoPoint || cloud.z[front] > 0);
}

TEST(PointProjection, OnTheEdgesOfThePicture) {
  for (const int side : {1, 2, 7, 512, 640}) {
    PinholeCamera camera;
    camera.width_px = camera.height_px = side;
    camera.fx_px = camera.fy_px = 1;
    camera.cx_px = camera.cy_px = 0;
    Cloud cloud;
    const float last = float(side) - 0.5f;
    for (const float at : {-0.5f, std::nextafter(-0.5f, -1.0f), std::nextafter(last, 0.0f), last}) {
      cloud.add({at, at, 1});
    }
    const FrontPoints visible(cloud.positions(), camera, 0.1);
    const auto& fronts = visible.points;
    EXPECT_EQ(fronts.front(), 0u) << side;
    EXPECT_EQ(fronts.back(), side == 1 ? 0u : 2u) << side;
    EXPECT_EQ(std::count(fronts.begin(), fronts.end(), kNoPoint), int64_t(side) * side - (side == 1 ? 1 : 2));
  }
}

TEST(PointProjection, TheNearestIsVisibleAndOfEqualsTheFirst) {
  const PinholeCamera camera = camera_of(3, 3, 60);
  Cloud cloud;
  for (const double depth : {5.0, 2.0, 2.0, 3.0, 2.0}) cloud.add({0, 0, depth});
  FrontPoints visible(cloud.positions(), camera, 0.1);
  EXPECT_EQ(visible.points[4], 1u);
  EXPECT_EQ(visible.depths[4], 2);
  for (int i = 0; i < 100000; ++i) cloud.add({0, 0, 2});
  cloud.add({0, 0, 1.9999});
  visible = FrontPoints(cloud.positions(), camera, 0.1);
  EXPECT_EQ(visible.points[4], cloud.x.size() - 1);
}

TEST(PointProjection, WhatIsNotFiniteIsNotSeen) {
  const float nan = std::numeric_limits<float>::quiet_NaN(), infinite = std::numeric_limits<float>::infinity();
  Cloud cloud;
  for (const float bad : {nan, infinite, -infinite, std::numeric_limits<float>::max()}) {
    for (int k = 0; k < 3; ++k) {
      float position[3] = {0, 0, 2};
      position[k] = bad;
      cloud.x.push_back(position[0]);
      cloud.y.push_back(position[1]);
      cloud.z.push_back(position[2]);
    }
  }
  const FrontPoints visible(cloud.positions(), camera_of(16, 16, 60), 0.1);
  for (const uint32_t front : visible.points) {
    EXPECT_TRUE(front == kNoPoint || cloud.z[front] == std::numeric_limits<float>::max()) << front;
  }
}

TEST(PointProjection, WithoutPointsThereIsNothing) {
  const FrontPoints visible({}, camera_of(5, 4, 60), 0.1);
  EXPECT_EQ(visible.points, std::vector<uint32_t>(20, kNoPoint));
}

}  // namespace
