#include <gtest/gtest.h>

#include <opencv2/videoio.hpp>

#include "sources/registry.h"
#include "support/expect_error.h"
#include "support/samples/variable_rate_clip.h"
#include "support/temp_folder.h"

namespace {

// A clip whose frame k has the grey level 8 * k.
std::string written_clip(const TempFolder& folder, const std::string& name, int frames, double fps) {
  const bool is_mp4 = name.find(".mp4") != std::string::npos;
  const int fourcc = is_mp4 ? cv::VideoWriter::fourcc('m', 'p', '4', 'v') : cv::VideoWriter::fourcc('M', 'J', 'P', 'G');
  cv::VideoWriter writer(folder.file(name), fourcc, fps, cv::Size(64, 48));
  EXPECT_TRUE(writer.isOpened());
  for (int k = 0; k < frames; ++k) writer.write(cv::Mat(48, 64, CV_8UC3, cv::Scalar::all(8 * k)));
  return folder.file(name);
}

TEST(VideoFiles, FramesComeInOrderWithTheirTimes) {
  const TempFolder folder;
  for (const char* name : {"a.avi", "a.mp4"}) {
    const auto source = maq::open_source("video:" + written_clip(folder, name, 20, 10));
    EXPECT_EQ(source->info().frame_count, 20);
    EXPECT_EQ(source->info().width_px, 64);
    EXPECT_NEAR(source->info().fps, 10, 0.01);
    maq::Frame frame;
    for (int k = 0; k < 20; ++k) {
      ASSERT_EQ(source->next(0, frame), maq::NextFrame::kFrame) << name << " frame " << k;
      EXPECT_NEAR(frame.storage[0], 8 * k, 6);  // lossy, and stored as YUV
      EXPECT_NEAR(double(frame.timestamp_ns), k * 1e8, 1e6);
      EXPECT_EQ(frame.sequence, uint64_t(k));
    }
    EXPECT_EQ(source->next(0, frame), maq::NextFrame::kEnd);
    EXPECT_EQ(source->next(0, frame), maq::NextFrame::kEnd);
  }
}

std::vector<maq::Frame> rest_of(maq::Source& source) {
  std::vector<maq::Frame> frames;
  for (;;) {
    maq::Frame frame;
    if (source.next(0, frame) != maq::NextFrame::kFrame) return frames;
    frames.push_back(std::move(frame));
  }
}

TEST(VideoFiles, FramesOfAVaryingRateThatAreReorderedKeepTheirTimesToTheLast) {
  const TempFolder folder;
  const VariableRateClip clip(read_text(MAQ_TEST_MEDIA "/clip.mp4"), {512, 1024, 256, 2048});
  write_text(folder.file("a.mp4"), clip.bytes());
  const std::vector<double> expected_s = clip.times_s();
  const auto source = maq::open_source("video:" + folder.file("a.mp4"));
  const std::vector<maq::Frame> frames = rest_of(*source);
  ASSERT_EQ(frames.size(), expected_s.size());
  // Decoders do not report the times of the frames that they held back to the end.
  constexpr size_t kHeldBack = 3;
  for (size_t i = 0; i < frames.size(); ++i) {
    const double time_s = double(frames[i].timestamp_ns) * 1e-9;
    EXPECT_NEAR(time_s, expected_s[i], i + kHeldBack < frames.size() ? 1e-3 : 0.05) << i;
    const int64_t before_ns = i == 0 ? -1000000000 : frames[i - 1].timestamp_ns;
    EXPECT_GT(frames[i].timestamp_ns - before_ns, 10000000) << i;
  }
}

TEST(VideoFiles, GoToATimeForwardsBackwardsAndBehindTheEnd) {
  const TempFolder folder;
  const VariableRateClip varying(read_text(MAQ_TEST_MEDIA "/clip.mp4"), {512, 1024, 256, 2048});
  write_text(folder.file("varying.mp4"), varying.bytes());
  const std::string long_clip = written_clip(folder, "long.mp4", 31, 2);
  for (const std::string& path : {std::string(MAQ_TEST_MEDIA "/clip.mp4"), folder.file("varying.mp4"), long_clip,
                                  written_clip(folder, "long.avi", 31, 2)}) {
    const auto source = maq::open_source("video:" + path);
    EXPECT_TRUE(source->can_seek());
    const std::vector<maq::Frame> frames = rest_of(*source);
    ASSERT_GT(frames.size(), 30u);
    for (const size_t k : {size_t(20), size_t(0), frames.size() - 4, size_t(3), size_t(29)}) {
      SCOPED_TRACE(path + " frame " + std::to_string(k));
      const maq::Frame& expected = frames[k];
      for (const int64_t before_ns : {int64_t(0), int64_t(1000000)}) {
        source->seek(std::max<int64_t>(0, expected.timestamp_ns - before_ns));
        maq::Frame found;
        ASSERT_EQ(source->next(0, found), maq::NextFrame::kFrame);
        EXPECT_NEAR(double(found.timestamp_ns), double(expected.timestamp_ns), 1e6);
        EXPECT_EQ(found.storage, expected.storage);
        const bool has_one_rate = path != folder.file("varying.mp4");
        EXPECT_TRUE(found.sequence == expected.sequence || !has_one_rate) << found.sequence;
      }
    }
    source->seek(frames.back().timestamp_ns + 100000000000);
    maq::Frame none;
    EXPECT_EQ(source->next(0, none), maq::NextFrame::kEnd) << path;
    source->seek(0);
    EXPECT_EQ(rest_of(*source).size(), frames.size()) << path;
  }
}

TEST(VideoFiles, ALowerRateThinsTheClipOutAndASizeScalesIt) {
  const TempFolder folder;
  const auto source = maq::open_source("video:" + written_clip(folder, "a.avi", 20, 10) + "?fps=2.5&size=32x32");
  maq::Frame frame;
  std::vector<uint64_t> sequence;
  while (source->next(0, frame) == maq::NextFrame::kFrame) {
    sequence.push_back(frame.sequence);
    EXPECT_EQ(frame.image.width_px, 32);
  }
  EXPECT_EQ(sequence, (std::vector<uint64_t>{0, 4, 8, 12, 16}));
  EXPECT_EQ(source->info().frame_count, 5);
}

TEST(VideoFiles, ATruncatedClipGivesItsFramesAndThenSaysSo) {
  const TempFolder folder;
  const std::string whole = read_text(written_clip(folder, "a.avi", 60, 10));
  write_text(folder.file("cut.avi"), whole.substr(0, whole.size() / 2));
  const auto source = maq::open_source("video:" + folder.file("cut.avi"));
  maq::Frame frame;
  int frames = 0;
  expect_error(MAQ_ERROR_UNREADABLE, "truncated", [&] {
    while (source->next(0, frame) == maq::NextFrame::kFrame) ++frames;
  });
  EXPECT_GT(frames, 10);
  EXPECT_LT(frames, 55);
}

TEST(VideoFiles, WhatIsNoClipIsRefusedWhenOpened) {
  const TempFolder folder;
  expect_error(MAQ_ERROR_NOT_FOUND, "does not exist", [&] { maq::open_source("video:" + folder.file("none.mp4")); });
  const std::string whole = read_text(written_clip(folder, "a.mp4", 20, 10));
  write_text(folder.file("cut.mp4"), whole.substr(0, whole.size() / 2));
  write_text(folder.file("empty.mp4"), "");
  write_text(folder.file("text.mp4"), "a text");
  for (const char* name : {"cut.mp4", "empty.mp4", "text.mp4"}) {
    expect_error(MAQ_ERROR_UNREADABLE, name, [&] {
      const auto source = maq::open_source("video:" + folder.file(name));
      maq::Frame frame;
      source->next(0, frame);
    });
  }
}

}  // namespace
