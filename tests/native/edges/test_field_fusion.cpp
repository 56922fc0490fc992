// Fused fields: as the reference in float64, whatever the order of views; extreme poses, plates and numbers of views.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include "edges/fusion/field_fusion.h"
#include "support/expect_error.h"

namespace {

using maq::EdgeField;
using maq::FieldFusion;
using maq::FusedField;
using maq::FusedPoint;
using maq::FusionOptions;
using maq::PinholeCamera;
using maq::Vec3;

constexpr float kEps = 16;

struct PosedField {
  EdgeField field;
  PinholeCamera camera;
};

// The field of a camera, with a depth (0: nothing) and distance (r) for each pixel.
template <class OfPixel>
PosedField posed_field(const PinholeCamera& camera, OfPixel of_pixel) {
  PosedField made;
  made.camera = camera;
  made.field.width = camera.width_px, made.field.height = camera.height_px;
  made.field.intrinsics = camera.intrinsics();
  made.field.eps_r = kEps;
  for (int y = 0; y < camera.height_px; ++y) {
    for (int x = 0; x < camera.width_px; ++x) {
      const auto [depth, distance] = of_pixel(x, y);
      made.field.depth_m.push_back(depth);
      made.field.distance_r.push_back(distance);
    }
  }
  return made;
}

PinholeCamera camera_at(std::array<double, 3> centre, std::array<double, 9> rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1}) {
  PinholeCamera camera;
  camera.width_px = 40, camera.height_px = 30;
  camera.fx_px = camera.fy_px = 50;
  camera.cx_px = 19.5, camera.cy_px = 14.5;
  camera.rotation = rotation;
  camera.centre = centre;
  return camera;
}

constexpr std::array<double, 9> kBackward = {-1, 0, 0, 0, 1, 0, 0, 0, -1};  // looks along -z

// A wall a metre before the camera, with an edge along the image's middle row.
PosedField wall(const PinholeCamera& camera, bool has_edge = true) {
  return posed_field(camera, [&](int, int y) {
    return std::pair{1.0f, has_edge ? float(0.9 * std::abs(y - camera.cy_px)) : kEps};
  });
}

FusedField fuse(const FieldFusion& fusion, int threads = 1) {
  maq::WorkerThreads workers(threads);
  const std::atomic<bool> is_cancelled{false};
  FusedField found;
  fusion.fuse(workers, is_cancelled, {}, found);
  return found;
}

FusedField fuse(const std::vector<PosedField>& views, const FusionOptions& options = {}) {
  FieldFusion fusion(options);
  for (const PosedField& view : views) fusion.add_view(view.field, view.camera);
  return fuse(fusion);
}

void expect_same(const FusedField& a, const FusedField& b) {
  ASSERT_EQ(a.points.size(), b.points.size());
  for (size_t i = 0; i < a.points.size(); ++i) {
    EXPECT_EQ(a.points[i].point.x, b.points[i].point.x);
    EXPECT_EQ(a.points[i].normal.y, b.points[i].normal.y);
    EXPECT_EQ(a.points[i].distance_m, b.points[i].distance_m);
    EXPECT_EQ(a.points[i].views, b.points[i].views);
  }
}

struct Reference {
  nlohmann::json document = nlohmann::json::parse(std::ifstream(MAQ_TEST_DATA "/edge_fusion/views.json"));

  std::vector<PosedField> views() const {
    std::vector<PosedField> made;
    for (const auto& view : document["views"]) {
      PinholeCamera camera;
      camera.width_px = view["size"][0], camera.height_px = view["size"][1];
      camera.fx_px = view["intrinsics"][0], camera.fy_px = view["intrinsics"][1];
      camera.cx_px = view["intrinsics"][2], camera.cy_px = view["intrinsics"][3];
      camera.rotation = view["rotation"].get<std::array<double, 9>>();
      camera.centre = view["centre"].get<std::array<double, 3>>();
      made.push_back(posed_field(camera, [&](int x, int y) {
        const auto at = size_t(y) * size_t(camera.width_px) + size_t(x);
        return std::pair{view["depth"][at].get<float>(), view["distance"][at].get<float>()};
      }));
    }
    return made;
  }
};

// 1/256 of a cell, to which places are rounded down, is 0.004 r here; it moves distances by as much.
TEST(FieldFusion, IsTheReferencesWithinAHundredthOfAFootprint) {
  const Reference reference;
  const FusedField found = fuse(reference.views());
  const auto& expected = reference.document;
  ASSERT_EQ(found.points.size(), expected["points"].size());
  EXPECT_NEAR(found.cell_m, expected["cell_m"], 1e-9);
  for (size_t i = 0; i < found.points.size(); ++i) {
    const FusedPoint& point = found.points[i];
    const double near = 0.01 * found.cell_m;
    EXPECT_NEAR(point.point.x, expected["points"][i][0], near) << i;
    EXPECT_NEAR(point.point.y, expected["points"][i][1], near) << i;
    EXPECT_NEAR(point.point.z, expected["points"][i][2], near) << i;
    EXPECT_NEAR(point.normal.x, expected["normals"][i][0], 0.01) << i;
    EXPECT_NEAR(point.normal.z, expected["normals"][i][2], 0.01) << i;
    EXPECT_EQ(point.views, expected["views_of_point"][i]) << i;
    EXPECT_NEAR(point.distance_m, expected["distance_m"][i], near) << i;
  }
}

TEST(FieldFusion, TheOrderOfViewsHasNoEffectAtAll) {
  std::vector<PosedField> views = Reference().views();
  const FusedField first = fuse(views);
  for (int k = 0; k < 5; ++k) {
    std::next_permutation(views.begin(), views.end(),
                          [](const PosedField& a, const PosedField& b) { return a.camera.centre < b.camera.centre; });
    expect_same(first, fuse(views));
  }
}

TEST(FieldFusion, ThreadsHaveNoEffect) {
  FieldFusion fusion;
  for (const PosedField& view : Reference().views()) fusion.add_view(view.field, view.camera);
  expect_same(fuse(fusion, 1), fuse(fusion, 3));
}

TEST(FieldFusion, OneViewIsItsOwnField) {
  const FusedField found = fuse({wall(camera_at({0, 0, 0}))});
  EXPECT_GT(found.points.size(), 1000u);
  for (const FusedPoint& point : found.points) {
    EXPECT_NEAR(point.r_m, 0.02, 1e-6);
    EXPECT_NEAR(point.point.z, 1, 0.001);
    EXPECT_NEAR(point.normal.z, -1, 1e-4);
    EXPECT_EQ(point.views, 1);
    EXPECT_NEAR(point.distance_m / point.r_m, 0.9 * std::abs(point.point.y) * 50, 0.46);
  }
}

TEST(FieldFusion, TheSameViewAThousandTimesIsThatOfOnce) {
  const PosedField view = wall(camera_at({0, 0, 0}));
  const FusedField once = fuse({view}), often = fuse(std::vector<PosedField>(1000, view));
  ASSERT_EQ(once.points.size(), often.points.size());
  for (size_t i = 0; i < once.points.size(); ++i) {
    EXPECT_NEAR(once.points[i].distance_m, often.points[i].distance_m, 1e-7);
    EXPECT_EQ(once.points[i].point.y, often.points[i].point.y);
    EXPECT_EQ(often.points[i].views, 1000);
  }
}

TEST(FieldFusion, CamerasAMillionUnitsAwayFuseAsThoseNearby) {
  std::vector<PosedField> near = {wall(camera_at({0, 0, 0})), wall(camera_at({0.1, 0, 0}))}, far = near;
  for (PosedField& view : far) {
    for (double& c : view.camera.centre) c += 1e6;
  }
  const FusedField here = fuse(near), there = fuse(far);
  ASSERT_EQ(here.points.size(), there.points.size());
  EXPECT_NEAR(there.origin[2], 1e6, 1);
  for (size_t i = 0; i < here.points.size(); ++i) {
    EXPECT_NEAR(here.points[i].point.x, there.points[i].point.x, 1e-4);  // a float would be off by 0.06
    EXPECT_NEAR(here.points[i].distance_m, there.points[i].distance_m, 1e-5);
  }
}

// The front of a plate has an edge, its back has none.
TEST(FieldFusion, NothingGoesThroughAPlateOfTwoFootprints) {
  const PosedField front = wall(camera_at({0, 0, 0}));
  const PosedField back = wall(camera_at({0, 0, 2.04}, kBackward), false);
  const FusedField found = fuse({front, back});
  int fronts = 0, backs = 0;
  for (const FusedPoint& point : found.points) {
    ASSERT_EQ(point.views, 1);
    if (point.normal.z > 0) {
      ++backs;
      EXPECT_FLOAT_EQ(point.distance_m, kEps * point.r_m);
    } else {
      ++fronts;
      EXPECT_NEAR(point.distance_m / point.r_m, 0.9 * std::abs(point.point.y) * 50, 0.46);
    }
  }
  EXPECT_GT(fronts, 1000);
  EXPECT_GT(backs, 1000);
}

TEST(FieldFusion, AnEdgeThatHalfOfTheViewsMissIsKept) {
  const FusedField found = fuse({wall(camera_at({0, 0, 0})), wall(camera_at({0.02, 0, 0}), false)});
  int seen_twice = 0;
  for (const FusedPoint& point : found.points) {
    if (point.views < 2) continue;
    ++seen_twice;
    EXPECT_NEAR(point.distance_m / point.r_m, 0.9 * std::abs(point.point.y) * 50, 0.46);
  }
  EXPECT_GT(seen_twice, 1000);
}

TEST(FieldFusion, ViewsThatSeeNothingCountAndChangeNothing) {
  const PosedField view = wall(camera_at({0, 0, 0}));
  const PosedField blind = posed_field(camera_at({5, 5, 5}), [](int, int) { return std::pair{0.0f, kEps}; });
  const PosedField elsewhere = wall(camera_at({0, 0, -50}, kBackward));
  FieldFusion fusion;
  for (const PosedField* v : {&blind, &view, &blind}) fusion.add_view(v->field, v->camera);
  EXPECT_EQ(fusion.views(), 3);
  EXPECT_EQ(fusion.views_without_depth(), 2);
  expect_same(fuse({view}), fuse(fusion));
  FieldFusion nothing;
  EXPECT_TRUE(fuse(nothing).points.empty());
  nothing.add_view(blind.field, blind.camera);
  EXPECT_TRUE(fuse(nothing).points.empty());
  EXPECT_EQ(fuse({view, elsewhere}).points.size(), 2 * fuse({view}).points.size());
}

TEST(FieldFusion, NumbersThatAreNoneAreUnknownOrFar) {
  PosedField view = wall(camera_at({0, 0, 0}));
  for (size_t i = 0; i < view.field.depth_m.size(); i += 7) view.field.depth_m[i] = i % 2 == 0 ? NAN : INFINITY;
  for (size_t i = 3; i < view.field.depth_m.size(); i += 7) view.field.distance_r[i] = i % 2 == 0 ? NAN : -INFINITY;
  for (const FusedPoint& point : fuse({view}).points) {
    EXPECT_TRUE(std::isfinite(point.point.x) && std::isfinite(point.normal.x));
    EXPECT_TRUE(point.distance_m >= 0 && point.distance_m <= kEps * point.r_m * 1.000001f);
  }
}

TEST(FieldFusion, TooManyPixelsOrPointsAreAStatus) {
  FusionOptions options;
  options.max_pixels = 3000;  // of two views, 1200 each
  FieldFusion fusion(options);
  const PosedField view = wall(camera_at({0, 0, 0}));
  fusion.add_view(view.field, view.camera);
  fusion.add_view(view.field, view.camera);
  expect_error(MAQ_ERROR_UNSUPPORTED, "over the limit of 3000", [&] { fusion.add_view(view.field, view.camera); });
  EXPECT_EQ(fusion.views(), 2);  // what was there stays
  EXPECT_GT(fuse(fusion).points.size(), 1000u);
  options.max_points = 100;
  expect_error(MAQ_ERROR_UNSUPPORTED, "more than 100 points", [&] { fuse({view}, options); });
}

TEST(FieldFusion, FaultsOfAViewAreNamed) {
  FieldFusion fusion;
  PosedField view = wall(camera_at({0, 0, 0}));
  fusion.add_view(view.field, view.camera);
  PosedField other = view;
  other.camera.rotation[0] = 2;
  expect_error(MAQ_ERROR_INVALID_ARGUMENT, "rotation", [&] { fusion.add_view(other.field, other.camera); });
  other = view;
  other.camera.width_px = 41;
  expect_error(MAQ_ERROR_INVALID_ARGUMENT, "41 x 30 pixels", [&] { fusion.add_view(other.field, other.camera); });
  other = view;
  other.field.eps_r = 8;
  expect_error(MAQ_ERROR_INVALID_ARGUMENT, "one bundle", [&] { fusion.add_view(other.field, other.camera); });
  other = view;
  other.field.depth_m.pop_back();
  expect_error(MAQ_ERROR_INVALID_ARGUMENT, "planes", [&] { fusion.add_view(other.field, other.camera); });
}

}  // namespace
