// Clips: what is added can be watched, and a file is there when it is whole and not before.
#include <gtest/gtest.h>

#include <cmath>

#include "support/file_size_limit.h"
#include "support/picture_files.h"
#include "support/temp_folder.h"

namespace {

class ApiClips : public ::testing::Test {
 protected:
  // One colour, which says its number.
  maquette::Frame picture(int number, int width = 65, int height = 49) {
    pixels_.assign(size_t(width) * size_t(height) * 3, uint8_t(20 + 30 * number));
    return maquette::Frame(context_, describe(MAQ_PIXEL_RGB8, pixels_, width, height));
  }

  // Which an encoder cannot make small.
  maquette::Frame noise(int number) {
    pixels_ = speckled(160, 120, uint32_t(number) + 1);
    return maquette::Frame(context_, describe(MAQ_PIXEL_RGB8, pixels_, 160, 120));
  }

  void write(const std::string& path, int pictures) {
    maquette::Clip clip(context_, path, 10);
    for (int k = 0; k < pictures; ++k) clip.add(picture(k));
    clip.finish();
  }

  int frames_of(const std::string& path) {
    maquette::Source source(context_, "video:" + path);
    int frames = 0;
    while (source.next()) ++frames;
    return frames;
  }

  void expect_refused(const std::string& path, double fps, maq_status status, const std::string& part_of_text) {
    std::string text;
    EXPECT_EQ(status_of([&] { maquette::Clip(context_, path, fps); }, &text), status) << path << ' ' << fps;
    EXPECT_NE(text.find(part_of_text), std::string::npos) << text;
  }

  maquette::Context context_;
  TempFolder folder_;
  std::vector<uint8_t> pixels_;
};

TEST_F(ApiClips, AClipOfOddPicturesIsSeenAsItWasAdded) {
  for (const char* name : {"a.mp4", "b.MP4"}) {
    write(folder_.file(name), 7);
    maquette::Source source(context_, std::string("video:") + folder_.file(name));
    EXPECT_EQ(source.info().width_px, 64) << "an odd side loses its last column";
    EXPECT_EQ(source.info().height_px, 48);
    EXPECT_NEAR(source.info().fps, 10, 1e-6);
    EXPECT_EQ(source.info().frame_count, 7);
    for (int k = 0; k < 7; ++k) {
      const auto frame = source.next();
      ASSERT_TRUE(frame) << name << ' ' << k;
      EXPECT_NEAR(double(frame->desc().timestamp_ns), k * 1e8, 1e6) << name;
      EXPECT_NEAR(rgb_of(*frame)[64 * 24 * 3], 20 + 30 * k, 4) << name << ' ' << k;
    }
    EXPECT_FALSE(source.next());
  }
  EXPECT_EQ(files_in(folder_.path()), 2u);
}

TEST_F(ApiClips, ThePartThatIsLeftOutIsAtTheRightAndAtTheBottom) {
  std::vector<uint8_t> pixels(33 * 17 * 3, 200);
  for (size_t y = 0; y < 17; ++y) {
    for (size_t x = 0; x < 33; ++x) {
      if (x == 32 || y == 16) std::fill_n(&pixels[(y * 33 + x) * 3], 3, uint8_t(0));
    }
  }
  maquette::Clip clip(context_, folder_.file("a.mp4"), 25);
  clip.add(maquette::Frame(context_, describe(MAQ_PIXEL_RGB8, pixels, 33, 17)));
  clip.finish();
  const std::vector<uint8_t> seen = rgb_of(*maquette::Source(context_, "video:" + folder_.file("a.mp4")).next());
  ASSERT_EQ(seen.size(), 32u * 16 * 3);
  for (const uint8_t value : seen) EXPECT_NEAR(value, 200, 8);
}

TEST_F(ApiClips, APictureOfAnotherSizeIsRefusedAndTheClipGoesOn) {
  maquette::Clip clip(context_, folder_.file("a.mp4"), 10);
  clip.add(picture(0));
  std::string text;
  EXPECT_EQ(status_of([&] { clip.add(picture(1, 64, 48)); }, &text), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_NE(text.find("64 x 48 pixels, but the first of"), std::string::npos) << text;
  clip.add(picture(1));
  clip.finish();
  EXPECT_EQ(frames_of(folder_.file("a.mp4")), 2);
}

TEST_F(ApiClips, NoFileIsThereBeforeItIsFinishedAndThenItTakesTheOldOnesPlace) {
  const std::string path = folder_.file("a.mp4");
  {
    maquette::Clip clip(context_, path, 10);
    for (int k = 0; k < 3; ++k) clip.add(picture(k));
    EXPECT_FALSE(std::filesystem::exists(path));
  }
  EXPECT_EQ(files_in(folder_.path()), 0u) << "what was not finished is removed";
  write(path, 2);
  {
    maquette::Clip clip(context_, path, 10);
    clip.add(picture(0));
  }
  EXPECT_EQ(frames_of(path), 2);
  write(path, 5);
  EXPECT_EQ(frames_of(path), 5);
  EXPECT_EQ(files_in(folder_.path()), 1u);
}

TEST_F(ApiClips, AfterTheEndNothingCanBeAdded) {
  maquette::Clip clip(context_, folder_.file("a.mp4"), 10);
  std::string text;
  EXPECT_EQ(status_of([&] { clip.finish(); }, &text), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_NE(text.find("has no image yet"), std::string::npos) << text;
  clip.add(picture(0));
  clip.finish();
  clip.finish();  // does nothing
  EXPECT_EQ(status_of([&] { clip.add(picture(1)); }, &text), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_NE(text.find("is finished"), std::string::npos) << text;
  EXPECT_EQ(frames_of(folder_.file("a.mp4")), 1);
}

TEST_F(ApiClips, AFullDiskIsToldAndLeavesTheOldFile) {
  const std::string path = folder_.file("a.mp4");
  {
    maquette::Clip clip(context_, path, 10);
    for (int k = 0; k < 20; ++k) clip.add(noise(k));
    clip.finish();
  }
  const rlim_t whole = std::filesystem::file_size(path);
  std::filesystem::remove(path);
  write(path, 2);
  // In the head, among the images, in the index behind them, at the last byte.
  for (const rlim_t most : {rlim_t(0), rlim_t(20), rlim_t(10'000), whole / 2, whole - 200, whole - 1}) {
    maquette::Clip clip(context_, path, 10);
    const FileSizeLimit full(most);
    maq_status first = MAQ_OK;
    for (int k = 0; k < 20 && first == MAQ_OK; ++k) {
      const maquette::Frame frame = noise(k);
      first = maq_clip_add_frame(clip.get(), frame.get());
    }
    if (first == MAQ_OK) first = maq_clip_finish(clip.get());
    EXPECT_EQ(first, MAQ_ERROR_UNWRITABLE) << most << ": " << maq_last_error(clip.get());
    EXPECT_NE(maq_clip_finish(clip.get()), MAQ_OK) << "nor the second time";
  }
  EXPECT_EQ(frames_of(path), 2);
  std::filesystem::remove(path);
  EXPECT_EQ(files_in(folder_.path()), 0u) << "nothing is left over";
}

TEST_F(ApiClips, RatesAreKept) {
  for (const double fps : {0.01, 0.5, 23.976, 29.97, 59.94, 65.6, 119.88, 143.857, 655.351, 1000.0}) {
    maquette::Clip clip(context_, folder_.file("a.mp4"), fps);
    for (int k = 0; k < 3; ++k) clip.add(picture(k));
    clip.finish();
    EXPECT_NEAR(maquette::Source(context_, std::string("video:") + folder_.file("a.mp4")).info().fps, fps, fps * 2e-3);
  }
}

TEST_F(ApiClips, WhatIsNoClipIsRefusedAndLeavesNoFile) {
  for (const char* name : {"a.avi", "a", ".mp4", "a.mp4/"}) {
    expect_refused(folder_.file(name), 25, MAQ_ERROR_INVALID_ARGUMENT, "does not end in .mp4");
  }
  for (const double fps : {0.0, -1.0, 0.001, 1000.1, std::nan(""), HUGE_VAL}) {
    expect_refused(folder_.file("a.mp4"), fps, MAQ_ERROR_INVALID_ARGUMENT, "fps is");
  }
  expect_refused(folder_.file("none/a.mp4"), 25, MAQ_ERROR_UNWRITABLE, "none/a.mp4 cannot be made");
  expect_refused("/proc/a.mp4", 25, MAQ_ERROR_UNWRITABLE, "cannot be made");
  std::filesystem::create_directory(folder_.file("folder.mp4"));
  expect_refused(folder_.file("folder.mp4"), 25, MAQ_ERROR_UNWRITABLE, "is not a file");
  EXPECT_EQ(files_in(folder_.path()), 1u);
  maq_clip* clip = nullptr;
  EXPECT_EQ(maq_clip_create(context_.get(), nullptr, 25, &clip), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(clip, nullptr);
}

TEST_F(ApiClips, PicturesThatFitNoClipAreRefusedByName) {
  maquette::Clip clip(context_, folder_.file("a.mp4"), 10);
  const std::vector<uint8_t> depth(8 * 8 * 2);
  EXPECT_EQ(status_of([&] { clip.add(maquette::Frame(context_, describe(MAQ_PIXEL_DEPTH16, depth, 8, 8))); }),
            MAQ_ERROR_UNSUPPORTED);
  EXPECT_EQ(status_of([&] { clip.add(picture(0, 1, 8)); }), MAQ_ERROR_IMAGE_SIZE);
  EXPECT_EQ(status_of([&] { clip.add(picture(0, 8, 1)); }), MAQ_ERROR_IMAGE_SIZE);
  clip.add(picture(0, 2, 2));
  clip.finish();
  EXPECT_EQ(frames_of(folder_.file("a.mp4")), 1);
}

TEST_F(ApiClips, APathIsNeverTakenForAnAddress) {
  const auto before = std::filesystem::current_path();
  std::filesystem::current_path(folder_.path());
  write("pipe:1.mp4", 3);
  write("file:b.mp4", 3);
  std::filesystem::current_path(before);
  EXPECT_EQ(frames_of(folder_.file("pipe:1.mp4")), 3);
  EXPECT_EQ(frames_of(folder_.file("file:b.mp4")), 3);
  EXPECT_EQ(files_in(folder_.path()), 2u);
}

}  // namespace
