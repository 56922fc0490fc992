// Planes fitted to depth, and the flat regions of a frame.
#include "edges/measuring/plane_regions.h"

#include <gtest/gtest.h>

#include <random>

#include "support/samples/analytic_scenes.h"

namespace {

using namespace maq::test;
using maq::InversePlane;
using maq::InversePlaneSums;

// Solves the normal equations of the centred points by Cramer's rule, with long double throughout.
std::array<long double, 3> reference_fit(const std::vector<std::array<double, 3>>& points) {
  long double mean[3] = {};
  for (const auto& p : points) {
    for (int k = 0; k < 3; ++k) mean[k] += (long double)p[size_t(k)] / (long double)points.size();
  }
  long double xx = 0, xy = 0, yy = 0, xw = 0, yw = 0;
  for (const auto& p : points) {
    const long double x = p[0] - mean[0], y = p[1] - mean[1], w = p[2] - mean[2];
    xx += x * x, xy += x * y, yy += y * y, xw += x * w, yw += y * w;
  }
  const long double d = xx * yy - xy * xy, a = (xw * yy - yw * xy) / d, b = (yw * xx - xw * xy) / d;
  return {a, b, mean[2] - a * mean[0] - b * mean[1]};
}

TEST(PlaneRegions, TheFitIsThatOfTheReference) {
  std::mt19937 bits(3);
  std::normal_distribution<double> noise(0, 1e-3);
  for (const double spread : {0.5, 0.01}) {  // a whole frame, and a few pixels
    std::vector<std::array<double, 3>> points;
    InversePlaneSums sums;
    for (int i = 0; i < 100; ++i) {
      const double x = 0.3 + spread * (i % 10) / 10.0, y = -0.2 + spread * (i / 10) / 10.0;
      points.push_back({x, y, 0.9 + 0.4 * x - 0.7 * y + noise(bits)});
      sums.add(x, y, points.back()[2]);
    }
    InversePlane plane;
    double rms = 0;
    ASSERT_TRUE(fit_inverse_plane(sums, plane, rms));
    const auto expected = reference_fit(points);
    EXPECT_NEAR(plane.a, double(expected[0]), 1e-8);
    EXPECT_NEAR(plane.b, double(expected[1]), 1e-8);
    EXPECT_NEAR(plane.c, double(expected[2]), 1e-8);
    double squares = 0;
    for (const auto& p : points) squares += std::pow(p[2] - plane.at(p[0], p[1]), 2);
    EXPECT_NEAR(rms, std::sqrt(squares / 100), 1e-8);
    EXPECT_NEAR(rms_from(sums, plane), rms, 1e-8);
  }
}

TEST(PlaneRegions, PointsOnALineHaveNoPlane) {
  InversePlaneSums sums;
  InversePlane plane;
  double rms = 0;
  EXPECT_FALSE(fit_inverse_plane(sums, plane, rms));
  for (int i = 0; i < 50; ++i) sums.add(0.01 * i, 0.02 * i, 1);
  EXPECT_FALSE(fit_inverse_plane(sums, plane, rms));
}

SolidScene box_on_floor() {
  SolidScene scene;
  const int floor = add_floor(scene);
  scene.add_box({0, 0, 0}, {0.5, 0.36, 0.3}, 0.6, floor);
  scene.seen_from({0.1, -1.1, 0.75}, {0, 0, 0.14});
  return scene;
}

TEST(PlaneRegions, TheThreeFacesOfABoxAndTheFloorAreRegions) {
  maq::PlaneRegions regions;
  const SeenScene seen = see(box_on_floor(), camera_of(640, 480, 600));
  regions.find(seen.field);
  ASSERT_EQ(regions.regions().size(), 4u);
  for (const auto& region : regions.regions()) {
    EXPECT_LT(regions.roundness(int(&region - regions.regions().data())), 1e-3);
    EXPECT_NEAR(length(region.plane.normal), 1, 1e-12);
    EXPECT_LT(dot(region.plane.normal, region.centre), 0);  // it faces the camera
  }
}

TEST(PlaneRegions, TheErrorOfDepthIsEstimatedFromTheFrame) {
  for (const double sigma_m : {0.001, 0.004}) {
    maq::EdgeField field = see(box_on_floor(), camera_of(640, 480, 600)).field;
    std::mt19937 bits(7);
    std::normal_distribution<float> noise(0, float(sigma_m));
    for (float& depth : field.depth_m) depth += noise(bits);
    maq::PlaneRegions regions;
    regions.find(field);
    EXPECT_NEAR(regions.error().at(1.2), sigma_m, 0.35 * sigma_m);
  }
}

TEST(PlaneRegions, ABallIsRound) {
  maq::EdgeField field;
  field.width = 200, field.height = 200;
  field.intrinsics = camera_of(200, 200, 400);
  for (int v = 0; v < 200; ++v) {
    for (int u = 0; u < 200; ++u) {  // a ball of 0.15 m, 1 m away
      const double x = (u - field.intrinsics.cx_px) / 400, y = (v - field.intrinsics.cy_px) / 400;
      const double a = x * x + y * y + 1, root = 1 - a * (1 - 0.15 * 0.15);
      field.depth_m.push_back(root > 0 ? float((1 - std::sqrt(root)) / a) : 0.0f);
    }
  }
  maq::PlaneRegions regions;
  regions.find(field);
  for (size_t k = 0; k < regions.regions().size(); ++k) {
    if (regions.regions()[k].pixels() <= 400) continue;
    EXPECT_GT(regions.roundness(int(k)), 0.005) << k;
  }
}

}  // namespace
