#include <gtest/gtest.h>

#include <app/saver.h>

#include <future>

#include "support/temp_folder.h"

namespace {

namespace fs = std::filesystem;

maquette::RgbaImage image(int width, int height, uint8_t grey) {
  maquette::RgbaImage made;
  made.resize(width, height);
  std::fill(made.rgba.begin(), made.rgba.end(), grey);
  return made;
}

class Saver : public ::testing::Test {
 protected:
  // Returns the written files, after all jobs.
  std::vector<std::string> finished() {
    saver_.reset();
    std::vector<std::string> paths;
    for (const auto& entry : fs::directory_iterator(folder_.path())) paths.push_back(entry.path().string());
    return paths;
  }
  uint64_t frames_of(const std::string& clip) {
    maquette::Source source(context_, "video:" + clip);
    uint64_t count = 0;
    while (source.next()) ++count;
    return count;
  }
  // The message once all jobs so far are done.
  std::string message() {
    std::promise<void> done;
    saver_->run([&] {
      done.set_value();
      return std::string();
    });
    done.get_future().wait();
    return saver_->message();
  }

  TempFolder folder_;
  maquette::Context context_;
  std::optional<maquette::Saver> saver_{std::in_place, context_, folder_.path().string()};
};

TEST_F(Saver, ASnapshotHasThePixelsOfTheImage) {
  maquette::RgbaImage shown = image(40, 30, 50);
  shown.rgba[0] = 200, shown.rgba[1] = 100, shown.rgba[2] = 20, shown.rgba[3] = 255;
  saver_->save_snapshot(shown, nullptr);
  EXPECT_NE(message().find("Saved "), std::string::npos);
  const auto paths = finished();
  ASSERT_EQ(paths.size(), 1u) << "without people there is a picture alone";
  maquette::RgbaImage read;
  read.copy_from(*maquette::Source(context_, "image:" + paths[0]).next());
  ASSERT_EQ(read.width_px, 40);
  ASSERT_EQ(read.height_px, 30);
  EXPECT_EQ(read.rgba[0], 200);
  EXPECT_EQ(read.rgba[1], 100);
  EXPECT_EQ(read.rgba[2], 20);
  EXPECT_EQ(read.rgba[4], 50);
}

TEST_F(Saver, NoTwoPathsAreTheSame) { EXPECT_NE(saver_->new_path(".png"), saver_->new_path(".png")); }

TEST_F(Saver, AClipHasEachImageThatWasAdded) {
  saver_->begin_clip(10);
  EXPECT_TRUE(saver_->has_clip());
  for (int i = 0; i < 7; ++i) saver_->add_to_clip(image(64, 48, uint8_t(30 * i)));
  saver_->end_clip();
  EXPECT_FALSE(saver_->has_clip());
  EXPECT_EQ(message().find("Saved "), 0u);
  const auto paths = finished();
  ASSERT_EQ(paths.size(), 1u);
  EXPECT_EQ(frames_of(paths[0]), 7u);
}

TEST_F(Saver, AClipEndsWhereTheImagesGetAnotherSize) {
  saver_->begin_clip(10);
  for (int i = 0; i < 3; ++i) saver_->add_to_clip(image(64, 48, 100));
  saver_->add_to_clip(image(32, 48, 100));
  EXPECT_FALSE(saver_->has_clip());
  saver_->add_to_clip(image(64, 48, 100));
  const auto paths = finished();
  ASSERT_EQ(paths.size(), 1u);
  EXPECT_EQ(frames_of(paths[0]), 3u);
}

TEST_F(Saver, AClipThatIsOpenAtTheEndIsComplete) {
  saver_->begin_clip(10);
  for (int i = 0; i < 4; ++i) saver_->add_to_clip(image(64, 48, 100));
  const auto paths = finished();
  ASSERT_EQ(paths.size(), 1u);
  EXPECT_EQ(frames_of(paths[0]), 4u);
}

TEST_F(Saver, WhatCannotBeWrittenIsSaidAndWhatFollowsIsWritten) {
  fs::remove_all(folder_.path());
  saver_->begin_clip(10);
  saver_->add_to_clip(image(64, 48, 100));
  saver_->end_clip();
  const std::string problem = message();
  EXPECT_GT(problem.size(), 20u);
  EXPECT_EQ(problem.find("Saved"), std::string::npos) << problem;
  fs::create_directories(folder_.path());
  saver_->save_snapshot(image(8, 8, 0), nullptr);
  EXPECT_EQ(finished().size(), 1u);
}

TEST_F(Saver, NoImageIsTakenWhileManyWaitToBeWritten) {
  std::promise<void> disk;
  saver_->run([go = disk.get_future().share()] {
    go.wait();
    return std::string();
  });
  saver_->begin_clip(10);
  EXPECT_TRUE(saver_->takes_clip_images());
  int added = 0;
  for (; added < 1000 && saver_->takes_clip_images(); ++added) saver_->add_to_clip(image(64, 48, 100));
  EXPECT_LT(added, 100);
  EXPECT_TRUE(saver_->has_clip());
  disk.set_value();
  const auto paths = finished();
  ASSERT_EQ(paths.size(), 1u);
  EXPECT_EQ(frames_of(paths[0]), uint64_t(added));
}

}  // namespace
