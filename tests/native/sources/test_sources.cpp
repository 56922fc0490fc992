#include <gtest/gtest.h>

#include <sys/stat.h>

#include <filesystem>
#include <opencv2/imgcodecs.hpp>

#include "core/bounded_pool.h"
#include "sources/recording/recording.h"
#include "sources/registry.h"
#include "support/expect_error.h"
#include "support/temp_folder.h"

namespace {

using maq::NextFrame;

std::vector<uint8_t> frame_of(const std::string& uri, int index, maq::Frame* out = nullptr) {
  const auto source = maq::open_source(uri);
  maq::Frame frame;
  for (int i = 0; i <= index; ++i) EXPECT_EQ(source->next(0, frame), maq::NextFrame::kFrame);
  const std::vector<uint8_t> pixels = frame.storage;
  if (out != nullptr) *out = std::move(frame);
  return pixels;
}

size_t different_pixels(const std::vector<uint8_t>& a, const std::vector<uint8_t>& b) {
  size_t count = 0;
  for (size_t i = 0; i + 2 < a.size(); i += 3) count += a[i] != b[i] || a[i + 1] != b[i + 1] || a[i + 2] != b[i + 2];
  return count;
}

TEST(Sources, TheSameSeedShowsTheSameFrames) {
  const std::string uri = "stub:people?count=3&seed=7&size=160x120";
  EXPECT_EQ(frame_of(uri, 5), frame_of(uri, 5));
  EXPECT_NE(frame_of(uri, 5), frame_of("stub:people?count=3&seed=8&size=160x120", 5));
}

TEST(Sources, APathAloneIsTheFileOfThatName) {
  const TempFolder folder;
  cv::imwrite(folder.file("a.png"), cv::Mat(12, 16, CV_8UC3, cv::Scalar(1, 2, 3)));
  for (const char* name : {"what? 50%25.png", "12:30.png", "a.b:c?d=e.png"}) {
    std::filesystem::copy(folder.file("a.png"), folder.file(name));
    EXPECT_EQ(maq::open_source(folder.file(name))->info().width_px, 16) << name;
  }
  const auto before = std::filesystem::current_path();
  std::filesystem::current_path(folder.path());
  for (const char* name : {"a.png", "./a.png", "what? 50%25.png", "12:30.png"}) {
    EXPECT_EQ(maq::open_source(name)->info().width_px, 16) << name;
  }
  std::filesystem::current_path(before);
  EXPECT_EQ(maq::open_source(MAQ_TEST_MEDIA "/clip.mp4")->info().frame_count, 72);
  expect_error(MAQ_ERROR_NOT_FOUND, "write scheme:target", [] { maq::open_source("people"); });
  expect_error(MAQ_ERROR_INVALID_ARGUMENT, "is a folder", [&] { maq::open_source(folder.path().string()); });
  expect_error(MAQ_ERROR_INVALID_ARGUMENT, "is not a source", [] { maq::open_source(""); });
}

TEST(Sources, ACameraIsOpenedByItsPathOrItsNumber) {
  expect_error(MAQ_ERROR_NOT_FOUND, "/dev/video999 cannot be opened", [] { maq::open_source("/dev/video999"); });
  expect_error(MAQ_ERROR_NOT_FOUND, "/dev/video999 cannot be opened", [] { maq::open_source("v4l2:999?size=64x48"); });
  expect_error(MAQ_ERROR_NOT_FOUND, "/dev/v4l/by-id/none cannot", [] { maq::open_source("/dev/v4l/by-id/none"); });
}

TEST(Sources, WhatIsNoCameraIsNotOpenedAsOne) {
  const TempFolder folder;
  write_text(folder.file("a.txt"), "a text");
  ASSERT_EQ(::mkfifo(folder.file("fifo").c_str(), 0600), 0);
  for (const std::string& path : {std::string("/dev/tty"), std::string("/dev/null"), folder.file("a.txt"),
                                  folder.file("fifo"), folder.path().string()}) {
    expect_error(MAQ_ERROR_UNSUPPORTED, "is not a video device; name a camera, as in v4l2:/dev/video0",
                 [&] { maq::open_source("v4l2:" + path); });
  }
}

TEST(Sources, PeopleMoveAndFillPartOfThePicture) {
  const std::string uri = "stub:people?count=2&seed=3&size=160x120";
  const auto empty = frame_of("stub:people?count=0&seed=3&size=160x120", 0);
  const auto first = frame_of(uri, 0), later = frame_of(uri, 10);
  const size_t pixels = first.size() / 3;
  EXPECT_GT(different_pixels(first, empty), pixels / 50) << "there are people";
  EXPECT_LT(different_pixels(first, empty), pixels * 3 / 4) << "there is room around them";
  EXPECT_GT(different_pixels(first, later), pixels / 100) << "they move";
}

TEST(Sources, PeopleAreThereAfterHoursAndInTinyFrames) {
  const auto source = maq::open_source("stub:people?count=5&fps=0.01&size=64x48");
  maq::Frame frame;
  for (int i = 0; i < 300; ++i) ASSERT_EQ(source->next(0, frame), maq::NextFrame::kFrame);
  for (const char* size : {"1x1", "2x300", "300x2", "31x33"}) {
    frame_of(std::string("stub:people?count=4&size=") + size, 40);
    frame_of(std::string("stub:pattern?size=") + size, 40);
  }
}

TEST(Sources, StubsStampTheirFramesAndEndWhenAsked) {
  const auto source = maq::open_source("stub:pattern?fps=10&frames=3&size=32x24");
  EXPECT_EQ(source->info().frame_count, 3);
  maq::Frame frame;
  for (int64_t i = 0; i < 3; ++i) {
    ASSERT_EQ(source->next(0, frame), maq::NextFrame::kFrame);
    EXPECT_EQ(frame.timestamp_ns, i * 100000000);
    EXPECT_EQ(frame.sequence, uint64_t(i));
    EXPECT_EQ(frame.clock, MAQ_CLOCK_MEDIA);
  }
  EXPECT_EQ(source->next(0, frame), maq::NextFrame::kEnd);
  EXPECT_EQ(source->next(0, frame), maq::NextFrame::kEnd);
  EXPECT_EQ(maq::open_source("stub:pattern")->info().frame_count, -1);
}

TEST(Sources, TheEndOfTimeCanBeSoughtAndPlayed) {
  maq::Frame frame;
  for (const char* options : {"?fps=0.01", "?fps=30", "?fps=1000", "?fps=0.01&frames=1000000"}) {
    const auto source = maq::open_source(std::string("stub:pattern") + options + "&size=4x4");
    source->seek(INT64_MAX);
    while (source->next(0, frame) == NextFrame::kFrame && frame.sequence % 7 != 0) EXPECT_GE(frame.timestamp_ns, 0);
    EXPECT_LE(frame.timestamp_ns, int64_t(2e18));
  }
  expect_error(MAQ_ERROR_INVALID_ARGUMENT, "from 1 to 10000000",
               [] { maq::open_source("stub:pattern?fps=0.01&frames=10000001"); });
  // Two images 31 years apart, as slow as can be: the first is shown.
  const TempFolder folder;
  {
    maq::RecordingWriter writer(folder.file("long.maqrec"), {}, 0);
    frame.allocate_bgr(4, 4);
    for (const int64_t time_ns : {int64_t(0), int64_t(1e18)}) {
      frame.timestamp_ns = time_ns;
      writer.add(frame);
    }
    writer.finish();
  }
  const auto source = maq::open_source("rec:" + folder.file("long.maqrec") + "?live=1&loop=1&speed=0.01");
  EXPECT_EQ(source->next(int64_t(2e10), frame), NextFrame::kFrame);
  source->seek(INT64_MAX);
  EXPECT_EQ(source->next(int64_t(2e10), frame), NextFrame::kFrame);
}

TEST(Sources, AnImageIsOneFrameAtTheSizeAskedFor) {
  const TempFolder folder;
  cv::imwrite(folder.file("a.png"), cv::Mat(30, 40, CV_8UC3, cv::Scalar(1, 2, 3)));
  const auto plain = maq::open_source("image:" + folder.file("a.png"));
  EXPECT_EQ(plain->info().width_px, 40);
  EXPECT_EQ(plain->info().frame_count, 1);
  const auto scaled = maq::open_source("image:" + folder.file("a.png") + "?size=80x20&fps=5");
  maq::Frame frame;
  ASSERT_EQ(scaled->next(0, frame), maq::NextFrame::kFrame);
  EXPECT_EQ(frame.image.width_px, 80);
  EXPECT_EQ(frame.image.height_px, 20);
  EXPECT_EQ(frame.storage[2], 3);
  EXPECT_EQ(scaled->next(0, frame), maq::NextFrame::kEnd);
}

TEST(Sources, AFileIsOpenedAsWhatItsContentSays) {
  const TempFolder folder;
  const cv::Mat picture(30, 40, CV_8UC3, cv::Scalar(1, 2, 3));
  cv::imwrite(folder.file("a.png"), picture);
  std::filesystem::rename(folder.file("a.png"), folder.file("a.mp4.x"));
  maq::Frame frame;
  frame_of("file:" + folder.file("a.mp4.x") + "?size=20x15", 0, &frame);
  EXPECT_EQ(frame.image.width_px, 20);

  const std::string clip = std::string(MAQ_TEST_MEDIA) + "/clip.mp4";
  std::filesystem::copy_file(clip, folder.file("50% of a clip?"));
  frame_of("file:" + folder.file("50%25 of a clip%3F"), 3, &frame);
  EXPECT_EQ(frame.sequence, 3u);

  { maq::RecordingWriter(folder.file("take"), {}, 0).add(frame); }
  EXPECT_EQ(frame_of("file:" + folder.file("take"), 0), frame_of("video:" + clip, 3));

  expect_error(MAQ_ERROR_INVALID_ARGUMENT, "is a folder", [&] { maq::open_source("file:" + folder.path().string()); });
  expect_error(MAQ_ERROR_NOT_FOUND, "does not exist", [&] { maq::open_source("file:" + folder.file("none.mp4")); });
  expect_error(MAQ_ERROR_INVALID_ARGUMENT, "Option colour", [&] { maq::open_source("file:" + clip + "?colour=red"); });
}

TEST(Sources, WithoutACameraTheFirstOneIsNotFound) {
  if (!maq::list_cameras().empty()) GTEST_SKIP() << "this machine has a camera";
  expect_error(MAQ_ERROR_NOT_FOUND, "No camera was found", [] { maq::open_source("camera:"); });
  expect_error(MAQ_ERROR_NOT_FOUND, "No camera was found", [] { maq::open_source("camera:?size=640x480"); });
}

}  // namespace
