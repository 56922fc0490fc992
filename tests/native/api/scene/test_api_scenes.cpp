// Scene files through the C API: saved and opened again, and written over while they are in use.
#include <gtest/gtest.h>

#include <thread>

#include "support/samples/api_tiny_scene.h"
#include "support/samples/made_splats.h"

namespace {

class ApiScenes : public ::testing::Test {
 protected:
  ApiScenes() : scene_(api_tiny_scene::ball_scene(context_)) { scene_.save(path()); }

  std::string path() const { return folder_.file("ball.maqs"); }
  maq_status open(const std::string& path) const {
    maq_scene* scene = nullptr;
    const maq_status status = maq_scene_open(context_.get(), path.c_str(), &scene);
    EXPECT_EQ(scene != nullptr, status == MAQ_OK);
    maq_scene_destroy(scene);
    return status;
  }

  TempFolder folder_;
  maquette::Context context_;
  maquette::Scene scene_;
};

TEST_F(ApiScenes, AFileIsTheSceneThatWasSaved) {
  const maquette::Scene opened(context_, path());
  const maq_scene_info expected = scene_.info(), found = opened.info();
  EXPECT_GT(found.point_count, 1000u);
  EXPECT_LE(found.view_dependent_count, found.point_count);
  EXPECT_GE(found.block_count, 1u);
  EXPECT_EQ(std::memcmp(&expected, &found, sizeof found), 0);
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(found.bounds_min[axis], -1, 0.2);
    EXPECT_NEAR(found.bounds_max[axis], 1, 0.2);
  }
  opened.save(folder_.file("again.maqs"));
  EXPECT_EQ(read_text(folder_.file("again.maqs")), read_text(path()));
}

TEST_F(ApiScenes, AFileInMemoryIsTheSameSceneAndIsCopied) {
  std::string bytes = read_text(path());
  const maquette::Scene opened(context_, bytes.data(), bytes.size());
  bytes.assign(bytes.size(), 'x');
  opened.save(folder_.file("again.maqs"));
  EXPECT_EQ(read_text(folder_.file("again.maqs")), read_text(path()));
  maq_scene* scene = nullptr;
  EXPECT_EQ(maq_scene_open_memory(context_.get(), bytes.data(), bytes.size(), &scene), MAQ_ERROR_UNREADABLE);
  EXPECT_EQ(maq_scene_open_memory(context_.get(), bytes.data(), 0, &scene), MAQ_ERROR_UNREADABLE);
  EXPECT_EQ(scene, nullptr);
}

TEST_F(ApiScenes, ASceneInUseMayBeSavedToItsOwnFileOrDeleted) {
  const maquette::Scene opened(context_, path());
  const std::string bytes = read_text(path());
  opened.save(path());
  EXPECT_EQ(read_text(path()), bytes);
  std::filesystem::remove(path());
  opened.save(path());
  EXPECT_EQ(read_text(path()), bytes);
}

TEST_F(ApiScenes, SplatsOfOtherProgramsAreOpenedAndRenderedWithoutABundle) {
  MadeSplats made = made_splats(1, 1);
  made.splats[0].position = {1, 2, 10};
  made.splats[0].scale = {1, 1, 1};
  made.splats[0].opacity = 0.999;
  made.splats[0].coefficient = {1.5, 0, -1.5};
  made.splats[0].sh = {};
  write_text(folder_.file("splats.ply"), made.ply());
  const maquette::Scene splats(context_, folder_.file("splats.ply"));
  const maq_scene_info info = splats.info();
  EXPECT_EQ(info.point_count, 1u);
  EXPECT_EQ(info.view_dependent_count, 1u);
  EXPECT_EQ(info.block_count, 0u);
  EXPECT_EQ(info.coefficient_bits, 32);
  EXPECT_EQ(info.up[1], -1);
  EXPECT_EQ(info.bounds_max[2], 10);

  maq_scene_renderer_config config = maquette::default_scene_renderer_config();
  config.model.bundle_path = "there is none";
  config.use_background = 1;
  config.background[0] = 255;
  maquette::SceneRenderer renderer(context_, config, splats);
  maq_pinhole_camera camera{};
  camera.struct_size = sizeof camera;
  camera.intrinsics.width_px = camera.intrinsics.height_px = 64;
  camera.intrinsics.fx_px = camera.intrinsics.fy_px = 64;
  camera.intrinsics.cx_px = camera.intrinsics.cy_px = 32;
  camera.rotation[0] = camera.rotation[4] = camera.rotation[8] = 1;
  camera.centre[0] = 1, camera.centre[1] = 2;
  const maquette::Image image = renderer.run(camera);
  size_t stride = 0;
  const auto* const bgr = static_cast<const uint8_t*>(image.plane(MAQ_IMAGE_PLANE_BGR, &stride));
  const auto* const alpha = static_cast<const uint8_t*>(image.plane(MAQ_IMAGE_PLANE_ALPHA, &stride));
  const auto* const depth = static_cast<const float*>(image.plane(MAQ_IMAGE_PLANE_DEPTH, &stride));
  constexpr size_t kMiddle = 32 * 64 + 32;
  EXPECT_NEAR(bgr[3 * kMiddle + 2], 235, 2);
  EXPECT_NEAR(bgr[3 * kMiddle], 20, 2);
  EXPECT_NEAR(alpha[kMiddle], 252, 2);
  EXPECT_NEAR(double(depth[kMiddle]), 10, 0.01);
  EXPECT_EQ(bgr[2], 255);
  EXPECT_EQ(alpha[0], 0);
  EXPECT_EQ(image.scene_stats().shaded_point_count, 1u);

  EXPECT_EQ(maq_scene_save(splats.get(), folder_.file("splats.maqs").c_str()), MAQ_ERROR_UNSUPPORTED);
  EXPECT_EQ(maq_scene_save_ply(splats.get(), folder_.file("points.ply").c_str()), MAQ_ERROR_UNSUPPORTED);
  EXPECT_EQ(open(folder_.file("nothing.ply")), MAQ_ERROR_NOT_FOUND);
  write_text(folder_.file("points.ply"), made.ply("ascii", "rot_2"));
  EXPECT_EQ(open(folder_.file("points.ply")), MAQ_ERROR_UNSUPPORTED);
}

TEST_F(ApiScenes, PointsAreSavedAsSplatsThatShowTheSame) {
  for (const char* extension : {".ply", ".spz"}) {
    scene_.save(folder_.file(std::string("ball") + extension));
    const maquette::Scene splats(context_, folder_.file(std::string("ball") + extension));
    EXPECT_EQ(splats.info().point_count, scene_.info().point_count);
    for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(splats.info().bounds_min[axis], -1, 0.2);
    maquette::SceneRenderer renderer(context_, maquette::default_scene_renderer_config(), splats);
    const maquette::Image image = renderer.run(api_tiny_scene::camera_at(0.3, 100, 80));
    size_t stride = 0;
    const auto* const alpha = static_cast<const uint8_t*>(image.plane(MAQ_IMAGE_PLANE_ALPHA, &stride));
    const auto* const depth = static_cast<const float*>(image.plane(MAQ_IMAGE_PLANE_DEPTH, &stride));
    EXPECT_GT(alpha[40 * 100 + 50], 200);
    EXPECT_NEAR(double(depth[40 * 100 + 50]), 2, 0.15) << "a ball of radius 1, seen from 3 away";
    EXPECT_EQ(alpha[0], 0);
    splats.save(folder_.file("again.glb"));
    EXPECT_EQ(read_text(folder_.file("again.glb")).substr(0, 4), "glTF");
  }
}

TEST_F(ApiScenes, SeveralThreadsUseOneScene) {
  const maquette::Scene opened(context_, path());
  std::vector<std::thread> threads;
  for (int t = 0; t < 3; ++t) {
    threads.emplace_back([&, t] {
      const std::string file = folder_.file(std::to_string(t));
      opened.save(file + ".maqs");
      opened.save_ply(file + ".ply");
      EXPECT_EQ(opened.info().point_count, maquette::Scene(context_, file + ".maqs").info().point_count);
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(read_text(folder_.file("0.ply")), read_text(folder_.file("2.ply")));
}

TEST_F(ApiScenes, WhatCannotBeWrittenIsAStatusAndTheOldFileStays) {
  for (const auto save : {maq_scene_save, maq_scene_save_ply}) {
    EXPECT_EQ(save(scene_.get(), "/no/such/folder/ball.maqs"), MAQ_ERROR_UNWRITABLE);
    EXPECT_NE(std::string(maq_last_error(scene_.get())).find("/no/such/folder"), std::string::npos);
    EXPECT_EQ(save(scene_.get(), folder_.path().c_str()), MAQ_ERROR_UNWRITABLE);
    EXPECT_EQ(save(scene_.get(), ""), MAQ_ERROR_UNWRITABLE);
  }
  EXPECT_EQ(open(path()), MAQ_OK);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder_.path()), {}), 1) << "nothing is left over";
}

TEST_F(ApiScenes, FilesThatAreNoneAreAStatus) {
  EXPECT_EQ(open(folder_.file("none.maqs")), MAQ_ERROR_NOT_FOUND);
  EXPECT_NE(std::string(maq_last_error(context_.get())).find("none.maqs"), std::string::npos);
  EXPECT_EQ(open(folder_.path().string()), MAQ_ERROR_UNREADABLE);
  write_text(folder_.file("text.maqs"), "no scene");
  EXPECT_EQ(open(folder_.file("text.maqs")), MAQ_ERROR_UNREADABLE);
  write_text(folder_.file("empty.maqs"), "");
  EXPECT_EQ(open(folder_.file("empty.maqs")), MAQ_ERROR_UNREADABLE);
}

}  // namespace
