// Curves of a result through the C API: what they have, the size of a box, snapping, what is refused, files.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <limits>
#include <maquette/maquette.hpp>
#include <nlohmann/json.hpp>
#include <thread>
#include <vector>

#include "support/file_size_limit.h"
#include "support/temp_folder.h"

namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

double distance(const double* a, const double* b) { return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]); }

// The carton of this stub is 441 x 427 x 411 mm (make_solids_scene("box", 1)); its camera goes around it.
struct SeenCarton {
  SeenCarton() {
    while (result.size() < 8) {
      result.push_back(edges.run(*source.next()));
      curves.push_back(result.back().find_curves());
      if (!curves.back().boxes().empty()) break;
    }
  }

  const maquette::Context context;
  maquette::Source source{context, "stub:solids?scene=box&seed=1&fps=1&size=640x480"};
  maquette::Edges edges{context, config()};
  std::vector<maquette::EdgesResult> result;
  std::vector<maquette::EdgesCurves> curves;

 private:
  static maq_edges_config config() {
    maq_edges_config made = maquette::default_edges_config();
    made.model.bundle_path = MAQ_TEST_MODELS "/edges-int8";
    made.model.threads = 1;
    made.result_pool_size = 8;
    return made;
  }
};

class ApiEdgeCurves : public testing::Test {
 protected:
  static void SetUpTestSuite() { seen_ = new SeenCarton; }
  static void TearDownTestSuite() { delete std::exchange(seen_, nullptr); }

  static const maquette::EdgesResult& result() { return seen_->result.back(); }
  static const maquette::EdgesCurves& curves() { return seen_->curves.back(); }
  static maq_intrinsics camera() { return result().field().intrinsics; }
  static std::array<double, 2> pixel_of(const double* p) {
    return {camera().fx_px * p[0] / p[2] + camera().cx_px, camera().fy_px * p[1] / p[2] + camera().cy_px};
  }
  static SeenCarton* seen_;
};
SeenCarton* ApiEdgeCurves::seen_ = nullptr;

TEST_F(ApiEdgeCurves, ABoxHasItsSize) {
  ASSERT_FALSE(curves().boxes().empty()) << "in 8 views";
  const maq_edges_box box = curves().boxes()[0];
  const double truth[] = {0.441, 0.427, 0.411};
  for (size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(box.size_m[i], truth[i], 0.02);
    EXPECT_GT(box.size_tolerance_m[i], 0);
    EXPECT_LT(box.size_tolerance_m[i], 0.1);
    for (size_t k = 0; k < 3; ++k) {
      const double* a = box.axes[i];
      const double* b = box.axes[k];
      EXPECT_NEAR(a[0] * b[0] + a[1] * b[1] + a[2] * b[2], i == k ? 1 : 0, 1e-9);
    }
  }
  EXPECT_GE(box.corner_count, 4);
  const auto [x, y] = pixel_of(box.centre_m);
  EXPECT_LT(std::hypot(x - 320, y - 240), 150) << "the camera looks at it";
}

TEST_F(ApiEdgeCurves, CurvesHaveTheirPointsAndCorners) {
  const std::vector<maq_edges_curve> all = curves().curves();
  const std::vector<maq_edges_corner> corners = curves().corners();
  ASSERT_GE(all.size(), 6u);
  ASSERT_GE(corners.size(), 4u);
  std::vector<int> ends(corners.size(), 0);
  bool is_bent = false, is_beside = false;
  for (const maq_edges_curve& curve : all) {
    ASSERT_GE(curve.point_count, 2u);
    EXPECT_TRUE(curve.kind == MAQ_EDGES_KIND_CREASE || curve.kind == MAQ_EDGES_KIND_BOUNDARY);
    double length_m = 0;
    for (uint32_t i = 1; i < curve.point_count; ++i) {
      length_m += distance(curve.points_m + 3 * (i - 1), curve.points_m + 3 * i);
    }
    EXPECT_NEAR(curve.length_m, length_m, 0.01 * length_m);
    if (curve.type == MAQ_EDGES_CURVE_LINE) {
      EXPECT_EQ(curve.point_count, 2u);
    }
    EXPECT_EQ(curve.controls_m != nullptr, curve.type == MAQ_EDGES_CURVE_SPLINE);
    EXPECT_EQ(curve.control_count >= 4, curve.type == MAQ_EDGES_CURVE_SPLINE);
    EXPECT_EQ(curve.sweep_rad > 0, curve.type == MAQ_EDGES_CURVE_ARC);
    is_bent = is_bent || curve.convexity == MAQ_EDGES_CONVEXITY_CONVEX;
    for (size_t i = 0; i < 2; ++i) {
      const maq_edges_adjacent_plane& side = curve.adjacent_planes[i];
      if (side.is_known == 1) {
        is_beside = true;
        EXPECT_NEAR(std::hypot(side.normal[0], side.normal[1], side.normal[2]), 1, 1e-9);
      }
      if (curve.corners[i] < 0) continue;
      ASSERT_LT(size_t(curve.corners[i]), corners.size());
      ++ends[size_t(curve.corners[i])];
      const double* end = curve.points_m + (i == 0 ? 0 : 3 * (curve.point_count - 1));
      EXPECT_LT(distance(end, corners[size_t(curve.corners[i])].point_m), 1e-9);
    }
  }
  EXPECT_TRUE(is_bent);
  EXPECT_TRUE(is_beside);
  for (size_t i = 0; i < corners.size(); ++i) EXPECT_EQ(ends[i], corners[i].curve_count) << i;
  const maq_edges_curves_stats stats = curves().stats();
  EXPECT_GT(stats.curves_ms, 0);
  EXPECT_GE(stats.boxes_ms, 0);
  EXPECT_EQ(stats.bad_pixel_count, 0);
  EXPECT_GT(stats.voting_pixel_count, 1000);
  // A chain that turns becomes several curves, so that there may be few chains, and no more than curves and what is
  // lost.
  const int32_t kept = stats.chain_count - stats.short_chain_count - stats.over_limit_count;
  EXPECT_GT(kept, 0);
  EXPECT_LE(kept, int32_t(all.size()) + stats.without_depth_count + stats.not_fitted_count);
}

TEST_F(ApiEdgeCurves, PixelsAndTheirRaysSnapToTheSame) {
  const std::vector<maq_edges_corner> corners = curves().corners();
  for (uint32_t i = 0; i < corners.size(); ++i) {
    const double* point = corners[i].point_m;
    const auto [x, y] = pixel_of(point);
    const maq_edges_snap snap = curves().snap_to_pixel(x + 0.3, y, 5);
    ASSERT_EQ(snap.target, MAQ_EDGES_SNAP_CORNER);
    // Another corner may be nearer still.
    EXPECT_LE(snap.distance_px, 0.3 + 1e-6);
    const auto [snapped_x, snapped_y] = pixel_of(snap.point_m);
    EXPECT_NEAR(std::hypot(snapped_x - x - 0.3, snapped_y - y), snap.distance_px, 1e-6);
    EXPECT_EQ(distance(snap.point_m, corners[size_t(snap.index)].point_m), 0);
    const maq_edges_snap by_ray = curves().snap_to_ray(
        {0, 0, 0}, {(x + 0.3 - camera().cx_px) / camera().fx_px, (y - camera().cy_px) / camera().fy_px, 1}, 0.01);
    EXPECT_EQ(by_ray.target, MAQ_EDGES_SNAP_CORNER);
    EXPECT_LE(by_ray.angle_rad, 0.3 / camera().fx_px);
    EXPECT_GT(by_ray.angle_rad, 0);
    if (snap.distance_px > 0.3 - 1e-6) {
      EXPECT_EQ(snap.index, int32_t(i));
      EXPECT_EQ(by_ray.index, int32_t(i));
    }
  }
  const std::vector<maq_edges_curve> all = curves().curves();
  for (uint32_t i = 0; i < all.size(); ++i) {
    if (all[i].type != MAQ_EDGES_CURVE_LINE) continue;
    double middle[3];
    for (size_t k = 0; k < 3; ++k) middle[k] = 0.5 * (all[i].points_m[k] + all[i].points_m[3 + k]);
    // From elsewhere: a ray that crosses the line at its middle.
    const maq_edges_snap snap =
        curves().snap_to_ray({0.1, -0.2, -0.1}, {middle[0] - 0.1, middle[1] + 0.2, middle[2] + 0.1}, 1e-6);
    EXPECT_EQ(snap.target, MAQ_EDGES_SNAP_CURVE);
    EXPECT_EQ(snap.index, int32_t(i));
    EXPECT_LT(distance(snap.point_m, middle), 1e-6);
  }
}

TEST_F(ApiEdgeCurves, BetweenEdgesThereIsThePlaneOfThePixelAndOfTheRay) {
  const std::vector<maq_edges_curve> all = curves().curves();
  int planes = 0;
  for (int y = 20; y < 460; y += 20) {
    for (int x = 20; x < 620; x += 20) {
      const maq_edges_snap snap = curves().snap_to_pixel(x, y, 4);
      if (snap.target != MAQ_EDGES_SNAP_PLANE) continue;
      ++planes;
      const maq_edges_adjacent_plane& side = all[size_t(snap.index)].adjacent_planes[snap.adjacent_plane_index];
      ASSERT_EQ(side.is_known, 1);
      const double* p = snap.point_m;
      EXPECT_NEAR(side.normal[0] * p[0] + side.normal[1] * p[1] + side.normal[2] * p[2], side.offset_m, 1e-9);
      EXPECT_NEAR(p[2], double(result().depth_m()[y * 640 + x]), 0.05);
      const auto [px, py] = pixel_of(p);
      EXPECT_NEAR(px, x, 1e-6);
      EXPECT_NEAR(py, y, 1e-6);
      const maq_edges_snap by_ray = curves().snap_to_ray({0, 0, 0}, {p[0], p[1], p[2]}, 0.0005);
      EXPECT_EQ(by_ray.target, MAQ_EDGES_SNAP_PLANE);
      EXPECT_NEAR(by_ray.point_m[2], p[2], 0.05);
      EXPECT_EQ(by_ray.angle_rad, 0);
    }
  }
  EXPECT_GT(planes, 30);
  EXPECT_EQ(curves().snap_to_pixel(1e9, -1e9, 8).target, MAQ_EDGES_SNAP_NOTHING);
  EXPECT_EQ(curves().snap_to_pixel(kNaN, 3, 8).target, MAQ_EDGES_SNAP_NOTHING);
  EXPECT_EQ(curves().snap_to_ray({0, 0, 0}, {0, 0, -1}, 0.1).target, MAQ_EDGES_SNAP_NOTHING) << "away from all";
}

TEST_F(ApiEdgeCurves, OptionsAreThoseOfTheExtractor) {
  maq_edges_curves_config config = maquette::default_edges_curves_config();
  EXPECT_EQ(config.skip_boxes, 0);
  config.skip_boxes = 1;
  const maquette::EdgesCurves without = result().find_curves(config);
  EXPECT_EQ(without.curves().size(), curves().curves().size());
  EXPECT_TRUE(without.boxes().empty());
  config = maquette::default_edges_curves_config();
  config.min_length_px = 600;
  EXPECT_LT(result().find_curves(config).curves().size(), curves().curves().size());
}

TEST_F(ApiEdgeCurves, WhatIsAskedOfCurvesIsChecked) {
  maq_edges_curves* const held = curves().get();
  EXPECT_EQ(maq_edges_curves_get_curve_count(nullptr), 0u);
  EXPECT_EQ(maq_edges_curves_get_corner_count(nullptr), 0u);
  EXPECT_EQ(maq_edges_curves_get_box_count(nullptr), 0u);
  maq_edges_snap snap{};
  snap.struct_size = sizeof snap;
  for (const double radius : {-1.0, kNaN, 1e7}) {
    EXPECT_EQ(maq_edges_curves_snap_to_pixel(held, 1, 1, radius, &snap), MAQ_ERROR_INVALID_ARGUMENT);
  }
  const double origin[] = {0, 0, 0}, ahead[] = {0, 0, 1}, no_number[] = {0, kNaN, 0};
  EXPECT_EQ(maq_edges_curves_snap_to_ray(held, origin, ahead, 0.1, &snap), MAQ_OK);
  EXPECT_EQ(maq_edges_curves_snap_to_ray(held, origin, origin, 0.1, &snap), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_NE(std::strstr(maq_last_error(held), "direction has the length 0"), nullptr) << maq_last_error(held);
  EXPECT_EQ(maq_edges_curves_snap_to_ray(held, no_number, ahead, 0.1, &snap), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(maq_edges_curves_snap_to_ray(held, origin, no_number, 0.1, &snap), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(maq_edges_curves_snap_to_ray(held, origin, ahead, 2, &snap), MAQ_ERROR_INVALID_ARGUMENT);
}

TEST_F(ApiEdgeCurves, AreBoundedReusedAndOutliveTheResult) {
  std::vector<maquette::EdgesCurves> held;
  const uint32_t count = maq_edges_curves_get_curve_count(curves().get());
  {
    const maquette::Context context;
    maquette::Edges edges(context, MAQ_TEST_MODELS "/edges-int8");  // a pool of 4
    maquette::Source source(context, "stub:solids?scene=box&seed=1&size=320x240");
    const maquette::EdgesResult seen = edges.run(*source.next());
    for (int i = 0; i < 4; ++i) held.push_back(seen.find_curves());
    maq_edges_curves* found = nullptr;
    EXPECT_EQ(maq_edges_result_find_curves(seen.get(), nullptr, &found), MAQ_ERROR_POOL_EMPTY);
    const maq_edges_curves* const released = held.back().get();
    held.pop_back();
    maq_edges_curve curve{};
    curve.struct_size = sizeof curve;
    EXPECT_EQ(maq_edges_curves_get_curve(released, 0, &curve), MAQ_ERROR_INVALID_ARGUMENT);
    EXPECT_NE(std::strstr(maq_last_error(nullptr), "a maq_edges_curves that was given back before"), nullptr)
        << maq_last_error(nullptr);
    // Refused curves go back to the pool.
    maq_edges_curves_config config = maquette::default_edges_curves_config();
    config.min_length_px = -1;
    for (int i = 0; i < 5; ++i) {
      EXPECT_EQ(maq_edges_result_find_curves(seen.get(), &config, &found), MAQ_ERROR_INVALID_ARGUMENT);
    }
    held.push_back(seen.find_curves());
  }
  EXPECT_GT(count, 0u);
  const std::vector<maq_edges_curve> expected = held[0].curves();
  for (const maquette::EdgesCurves& one : held) {
    ASSERT_EQ(one.curves().size(), expected.size());
    for (size_t i = 0; i < expected.size(); ++i) EXPECT_EQ(one.curves()[i].length_m, expected[i].length_m);
    one.snap_to_pixel(160, 120, 8);
  }
}

TEST_F(ApiEdgeCurves, ThreadsFindAndReadThemAtOnce) {
  std::vector<std::thread> threads;
  for (int i = 0; i < 4; ++i) {
    threads.emplace_back([&] {
      const maquette::EdgesCurves own = result().find_curves();
      const std::vector<maq_edges_curve> found = own.curves(), shared = curves().curves();
      ASSERT_EQ(found.size(), shared.size());
      for (size_t k = 0; k < found.size(); ++k) EXPECT_EQ(found[k].length_m, shared[k].length_m);
      EXPECT_EQ(curves().snap_to_pixel(320, 240, 500).target, own.snap_to_pixel(320, 240, 500).target);
    });
  }
  for (std::thread& thread : threads) thread.join();
}

TEST_F(ApiEdgeCurves, AreSavedByTheEndingOfTheName) {
  const TempFolder folder;
  for (const char* name : {"a.json", "a.obj", "a.ply", "a.dxf", "a.step", "a.stp"}) curves().save(folder.file(name));
  const auto document = nlohmann::json::parse(read_text(folder.file("a.json")));
  const std::vector<maq_edges_curve> all = curves().curves();
  ASSERT_EQ(document["curves"].size(), all.size());
  for (size_t i = 0; i < all.size(); ++i) {
    EXPECT_EQ(document["curves"][i]["length_m"].get<double>(), all[i].length_m);
    EXPECT_EQ(document["curves"][i]["points"].size(), all[i].point_count);
  }
  EXPECT_EQ(read_text(folder.file("a.step")), read_text(folder.file("a.stp")));
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 6);
}

TEST_F(ApiEdgeCurves, FilesThatCannotBeWrittenLeaveWhatWasThere) {
  const TempFolder folder;
  const maq_edges_curves* const held = curves().get();
  for (const char* name : {"a.stl", "a", "a.STEP", ""}) {
    EXPECT_EQ(maq_edges_curves_save(held, folder.file(name).c_str()), MAQ_ERROR_INVALID_ARGUMENT) << name;
    EXPECT_NE(std::strstr(maq_last_error(held), ".json, .obj, .ply, .dxf or .step"), nullptr) << maq_last_error(held);
  }
  EXPECT_EQ(maq_edges_curves_save(held, "/nowhere/a.dxf"), MAQ_ERROR_UNWRITABLE);
  for (const char* name : {"a.json", "a.obj", "a.ply", "a.dxf", "a.step"}) {
    write_text(folder.file(name), name);
    const FileSizeLimit limit(100);
    EXPECT_EQ(maq_edges_curves_save(held, folder.file(name).c_str()), MAQ_ERROR_UNWRITABLE) << name;
  }
  for (const char* name : {"a.json", "a.obj", "a.ply", "a.dxf", "a.step"}) {
    EXPECT_EQ(read_text(folder.file(name)), name);
  }
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 5) << "nothing else is left";
}

}  // namespace
