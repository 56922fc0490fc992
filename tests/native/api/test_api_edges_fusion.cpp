// Fusion through the C API: views in, points and curves out, what is refused; captures with depth.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <maquette/maquette.hpp>
#include <nlohmann/json.hpp>
#include <optional>

#include "support/temp_folder.h"

namespace {

// The stub's camera stands still at its first frame of 1 fps: one view, added as if from several places.
class ApiEdgesFusion : public testing::Test {
 protected:
  ApiEdgesFusion() {
    maq_edges_config config = maquette::default_edges_config();
    config.model.bundle_path = MAQ_TEST_MODELS "/edges-int8";
    config.model.threads = 1;
    edges_.emplace(context_, config);
    frame_ = source_.next();
    result_.emplace(edges_->run(*frame_));
    camera_.struct_size = sizeof camera_;
    camera_.intrinsics = *source_.intrinsics();
    for (const int i : {0, 4, 8}) camera_.rotation[i] = 1;
  }

  const maquette::Context context_;
  maquette::Source source_{context_, "stub:solids?scene=box&seed=1&fps=1&size=320x240"};
  std::optional<maquette::Edges> edges_;
  std::optional<maquette::Frame> frame_;
  std::optional<maquette::EdgesResult> result_;
  maq_pinhole_camera camera_{};
};

TEST_F(ApiEdgesFusion, AViewBecomesPointsAndCurvesOfTheWorld) {
  maquette::EdgesFusion fusion(context_);
  camera_.centre[0] = 100;
  fusion.add_view(*result_, camera_);
  EXPECT_EQ(fusion.info().view_count, 1u);
  EXPECT_EQ(fusion.info().point_count, 0u);  // until it is finished
  fusion.finish();
  const maq_edges_fusion_info info = fusion.info();
  EXPECT_GT(info.point_count, 10000u);
  EXPECT_EQ(info.eps_r, 16);
  EXPECT_GT(info.cell_m, 0);
  for (const maq_edges_fusion_point& point : fusion.points()) {
    EXPECT_NEAR(point.point_m[0], 100, 10);
    EXPECT_GE(point.distance_m, 0);
    EXPECT_LE(point.distance_m, 16.001F * point.r_m);
    EXPECT_NEAR(std::hypot(point.normal[0], point.normal[1], point.normal[2]), 1, 1e-4);
  }
  const maquette::EdgesCurves fused = fusion.find_curves(), own = result_->find_curves();
  ASSERT_GT(fused.curves().size(), 3u);
  EXPECT_LE(fused.curves().size(), own.curves().size());
  EXPECT_NEAR(fused.curves()[0].points_m[0], 100, 10);
  EXPECT_TRUE(fused.boxes().empty());
  const TempFolder folder;
  fused.save(folder.file("model.dxf"));
  EXPECT_GT(std::filesystem::file_size(folder.file("model.dxf")), 500u);
  const auto axes_of = [&](const maquette::EdgesCurves& curves) {
    curves.save(folder.file("curves.json"));
    return nlohmann::json::parse(std::ifstream(folder.file("curves.json"))).at("axes").get<std::string>();
  };
  EXPECT_EQ(axes_of(fused), "metres; in the world of the cameras");
  EXPECT_EQ(axes_of(own), "metres; x right, y down, z along the optical axis");
  maq_edges_snap snap{};
  snap.struct_size = sizeof snap;
  EXPECT_EQ(maq_edges_curves_snap_to_pixel(fused.get(), 1, 1, 8, &snap), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_STREQ(
      maq_last_error(nullptr),
      "maq_edges_curves_snap_to_pixel: curves come from a fusion of several views, which have no common pixels; use "
      "maq_edges_curves_snap_to_ray.");
}

TEST_F(ApiEdgesFusion, AnEmptyCameraTakesTheIntrinsicsOfTheResult) {
  maquette::EdgesFusion given(context_), taken(context_);
  given.add_view(*result_, camera_);
  camera_.intrinsics = {};
  taken.add_view(*result_, camera_);
  given.finish();
  taken.finish();
  ASSERT_EQ(taken.points().size(), given.points().size());
  EXPECT_EQ(taken.points()[0].distance_m, given.points()[0].distance_m);
}

TEST_F(ApiEdgesFusion, ProgressGoesUpAndEndsIt) {
  struct Seen {
    double last = -1;
    bool goes_on = true;
  } seen;
  maq_edges_fusion_config config = maquette::default_edges_fusion_config();
  config.progress_callback = [](void* user_data, double done) -> int32_t {
    Seen& of = *static_cast<Seen*>(user_data);
    EXPECT_GE(done, of.last);
    of.last = done;
    return of.goes_on ? 1 : 0;
  };
  config.progress_user_data = &seen;
  maquette::EdgesFusion fusion(context_, config);
  fusion.add_view(*result_, camera_);
  fusion.finish();
  EXPECT_EQ(seen.last, 1);
  seen = {-1, false};
  EXPECT_EQ(maq_edges_fusion_finish(fusion.get()), MAQ_CANCELLED);
  EXPECT_EQ(fusion.info().point_count, 0u);
  seen = {};
  fusion.cancel();
  EXPECT_EQ(maq_edges_fusion_finish(fusion.get()), MAQ_CANCELLED);
  fusion.finish();
  EXPECT_GT(fusion.info().point_count, 0u);
}

TEST_F(ApiEdgesFusion, WhatIsWrongWithAViewIsSaid) {
  maq_edges_fusion_config config = maquette::default_edges_fusion_config();
  maquette::EdgesFusion fusion(context_, config);
  maq_pinhole_camera other = camera_;
  other.rotation[0] = -1;
  EXPECT_EQ(maq_edges_fusion_add_view(fusion.get(), result_->get(), &other), MAQ_ERROR_INVALID_ARGUMENT);
  other = camera_;
  other.intrinsics.width_px = 640;
  EXPECT_EQ(maq_edges_fusion_add_view(fusion.get(), result_->get(), &other), MAQ_ERROR_INVALID_ARGUMENT);
  other = camera_;
  other.struct_size = 4;
  EXPECT_EQ(maq_edges_fusion_add_view(fusion.get(), result_->get(), &other), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(maq_edges_fusion_add_view(fusion.get(), nullptr, &camera_), MAQ_ERROR_INVALID_ARGUMENT);
  fusion.add_view(*result_, camera_);
  EXPECT_EQ(fusion.info().view_count, 1u);
  fusion.finish();
  maq_edges_fusion_point point{};
  EXPECT_EQ(maq_edges_fusion_copy_points(fusion.get(), &point, 1), MAQ_ERROR_INVALID_ARGUMENT);
  config.min_views = -1;
  maq_edges_fusion* made = nullptr;
  EXPECT_EQ(maq_edges_fusion_create(context_.get(), &config, &made), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(made, nullptr);
}

// Without a cloud, which edges do not need.
TEST_F(ApiEdgesFusion, CapturesBringDepthAndItsCamera) {
  const TempFolder folder;
  frame_->save(folder.file("depth.tiff"));
  nlohmann::json frame = {{"file_path", "photo.png"},
                          {"depth_file_path", "depth.tiff"},
                          {"w", 640},
                          {"h", 480},
                          {"fl_x", 600.0},
                          {"transform_matrix", {{1, 0, 0, 1}, {0, -1, 0, 2}, {0, 0, -1, 3}, {0, 0, 0, 1}}}};
  std::vector<uint8_t> grey(640 * 480 * 3, 128);
  maq_frame_desc desc;
  maq_frame_desc_init(&desc, sizeof desc);
  desc.format = MAQ_PIXEL_BGR8;
  desc.width_px = 640, desc.height_px = 480;
  desc.planes[0] = grey.data();
  desc.stride_bytes[0] = 640 * 3;
  maquette::Frame(context_, desc).save(folder.file("photo.png"));
  const auto write = [&] {
    std::ofstream(folder.file("transforms.json")) << nlohmann::json{{"frames", {frame}}}.dump();
  };
  write();
  const maquette::Capture capture(context_, folder.path().string());
  EXPECT_EQ(capture.view(0).has_depth, 1);
  EXPECT_EQ(capture.info().point_count, 0u);
  const auto [depth, camera] = capture.load_depth(0);
  EXPECT_EQ(depth.desc().width_px, 320);
  EXPECT_EQ(camera.intrinsics.width_px, 320);
  EXPECT_EQ(depth.intrinsics()->fx_px, camera.intrinsics.fx_px);
  EXPECT_DOUBLE_EQ(camera.intrinsics.fx_px, 300);
  EXPECT_DOUBLE_EQ(camera.centre[2], 3);
  frame.erase("depth_file_path");
  write();
  maq_capture* opened = nullptr;
  EXPECT_EQ(maq_capture_open(context_.get(), folder.path().string().c_str(), &opened), MAQ_ERROR_NOT_FOUND);
}

}  // namespace
