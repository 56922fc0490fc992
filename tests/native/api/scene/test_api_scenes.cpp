// Scene files through the C API: saved and opened again, and written over while they are in use.
#include <gtest/gtest.h>

#include <thread>

#include "support/samples/api_tiny_scene.h"

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
