// Curves of several views as one set: nearer to the truth, and with more of it, than those of a view.
#include <gtest/gtest.h>

#include <algorithm>

#include "edges/curves/curve_extractor.h"
#include "edges/fusion/curve_fusion.h"
#include "support/samples/analytic_scenes.h"

namespace {

using namespace maq::test;
using maq::CurveExtractor;
using maq::CurveFusion;
using maq::CurveType;
using maq::EdgeCurve;
using maq::EdgeCurves;
using maq::PinholeCamera;
using maq::Vec3;

constexpr Vec3 kSize{0.5, 0.36, 0.3};
constexpr double kR = 1.2 / 300;  // a footprint, about

// A box seen from `eye`: its curves, from a field with the errors of a network, and the camera.
std::pair<EdgeCurves, PinholeCamera> box_from(Vec3 eye, unsigned seed) {
  SolidScene scene;
  scene.add_box({0, 0, 0}, kSize, 0, -1);
  const Vec3 target{0, 0, 0.14};
  scene.seen_from(eye, target);
  SeenScene seen = see(std::move(scene), camera_of(320, 240, 300));
  Damage by;
  by.blur_px = 0.7, by.noise_r = 0.7, by.flying_pixel_band_px = 2, by.depth_noise_r = 0.3;
  damage(seen, by, seed);
  PinholeCamera camera;
  camera.intrinsics() = seen.field.intrinsics;
  const Vec3 z = maq::normalized(target - eye), x = maq::normalized(maq::cross(z, {0, 0, 1})), y = maq::cross(z, x);
  camera.rotation = {x.x, x.y, x.z, y.x, y.y, y.z, z.x, z.y, z.z};
  camera.centre = {eye.x, eye.y, eye.z};
  CurveExtractor extractor;
  return {extractor.extract(seen.field), camera};
}

// The first of eight views from all around.
std::vector<std::pair<EdgeCurves, PinholeCamera>> views_of_box(size_t count) {
  static std::vector<std::pair<EdgeCurves, PinholeCamera>> views;
  while (views.size() < count) {
    const double a = 0.4 + kPi / 4 * 3 * double(views.size());
    views.push_back(box_from({1.1 * std::cos(a), 1.1 * std::sin(a), 0.75}, unsigned(views.size()) + 1));
  }
  return {views.begin(), views.begin() + std::ptrdiff_t(count)};
}

EdgeCurves fuse_curves(const std::vector<std::pair<EdgeCurves, PinholeCamera>>& views,
                       const std::array<double, 3>& origin = {0, 0, 0}) {
  CurveFusion fusion;
  for (const auto& [curves, camera] : views) fusion.add_view(curves, camera);
  EdgeCurves found;
  fusion.fuse(origin, found);
  return found;
}

double from_box_edges(Vec3 p) {
  double best = INFINITY;
  for (int axis = 0; axis < 3; ++axis) {
    for (const double s : {0.0, 1.0}) {
      for (const double t : {0.0, 1.0}) {
        Vec3 a{-kSize.x / 2, -kSize.y / 2, 0}, d{};
        (axis == 0 ? a.y : a.x) += s * (axis == 0 ? kSize.y : kSize.x);
        (axis == 2 ? a.y : a.z) += t * (axis == 2 ? kSize.y : kSize.z);
        (axis == 0 ? d.x : axis == 1 ? d.y : d.z) = axis == 0 ? kSize.x : axis == 1 ? kSize.y : kSize.z;
        const double u = std::clamp(maq::dot(p - a, d) / maq::dot(d, d), 0.0, 1.0);
        best = std::min(best, maq::length(p - a - u * d));
      }
    }
  }
  return best;
}

TEST(CurveFusion, TheVisibleEdgesOfABoxAreOneLineEach) {
  const EdgeCurves found = fuse_curves(views_of_box(8));
  double length_m = 0;
  for (const EdgeCurve& curve : found.curves) {
    EXPECT_EQ(curve.type, CurveType::kLine);
    length_m += curve.length_m;
    for (int i = 0; i < curve.point_count; ++i) {
      EXPECT_LT(from_box_edges(found.points[size_t(curve.first_point + i)]), 2 * kR);
    }
  }
  // All twelve, the lower four as boundaries.
  EXPECT_GE(found.curves.size(), 11u);
  EXPECT_LE(found.curves.size(), 13u);
  EXPECT_NEAR(length_m, 4 * (kSize.x + kSize.y + kSize.z), 0.3);
  EXPECT_GE(found.corners.size(), 6u);
}

TEST(CurveFusion, TheOrderOfViewsHasNoEffectButOnRounding) {
  auto views = views_of_box(5);
  const EdgeCurves first = fuse_curves(views);
  std::reverse(views.begin(), views.end());
  const EdgeCurves second = fuse_curves(views);
  ASSERT_EQ(first.points.size(), second.points.size());
  for (const Vec3& p : first.points) {
    double nearest = INFINITY;
    for (const Vec3& q : second.points) nearest = std::min(nearest, maq::length(p - q));
    EXPECT_LT(nearest, 1e-6);
  }
}

TEST(CurveFusion, AMillionUnitsAwayIsAsNearby) {
  auto views = views_of_box(4);
  const EdgeCurves near = fuse_curves(views);
  for (auto& [curves, camera] : views) {
    for (double& c : camera.centre) c += 1e6;
  }
  const EdgeCurves far = fuse_curves(views, {1e6, 1e6, 1e6});
  ASSERT_EQ(near.points.size(), far.points.size());
  for (size_t i = 0; i < near.points.size(); ++i) {
    EXPECT_LT(maq::length(near.points[i] + Vec3{1e6, 1e6, 1e6} - far.points[i]), 1e-6);
  }
}

TEST(CurveFusion, WhatOneOfManyViewsSaysAloneIsLeftOut) {
  auto views = views_of_box(4);
  EdgeCurves stray;
  EdgeCurve line;
  line.point_count = 2;
  stray.points = {{-0.3, 0.3, 0.8}, {0.3, 0.3, 0.8}};
  stray.curves.push_back(line);
  const size_t before = fuse_curves(views).curves.size();
  views.push_back({stray, views[0].second});
  EXPECT_EQ(fuse_curves(views).curves.size(), before);
  EXPECT_EQ(fuse_curves({{stray, views[0].second}}).curves.size(), 1u);  // but of one view it is all there is
}

TEST(CurveFusion, NothingAndNonsenseHaveNoCurves) {
  EXPECT_TRUE(fuse_curves({}).curves.empty());
  EdgeCurves nonsense;
  EdgeCurve line;
  line.point_count = 2;
  nonsense.points = {{NAN, 0, 1}, {0, INFINITY, -1}};
  nonsense.curves.push_back(line);
  EXPECT_TRUE(fuse_curves({{nonsense, PinholeCamera{}}}).curves.empty());
}

}  // namespace
