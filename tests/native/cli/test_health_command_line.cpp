// `maquette health` for its user: events, lines, clips, sentences.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/videoio.hpp>
#include <sstream>
#include <string>

#include "support/program_run.h"
#include "support/samples/square_clip.h"

namespace {

class HealthCommandLine : public ::testing::Test {
 protected:
  HealthCommandLine() { write_square_clip(folder_.file("square.avi")); }

  Outcome run(const std::string& arguments) const { return run_program(folder_, "MAQ_BUNDLE=", "health " + arguments); }
  void expect_failure(const std::string& arguments, const std::string& text) const {
    const Outcome result = run(arguments);
    EXPECT_EQ(result.exit_code, 1) << arguments;
    EXPECT_NE(result.err.find(text), std::string::npos) << result.err;
  }
  // The clip, then a black picture.
  void write_clip_that_turns_black() const {
    cv::VideoWriter clip(folder_.file("black.avi"), cv::VideoWriter::fourcc('M', 'J', 'P', 'G'), 20, {160, 120});
    cv::VideoCapture square(folder_.file("square.avi"));
    cv::Mat picture;
    for (int i = 0; i < 30; ++i) {
      if (i < 20) square.read(picture);
      if (i >= 20) picture = cv::Mat(120, 160, CV_8UC3, cv::Scalar(0, 0, 0));
      clip.write(picture);
    }
  }

  TempFolder folder_;
};

TEST_F(HealthCommandLine, EachFrameIsALineOfJson) {
  const Outcome lines = run("square.avi --json");
  ASSERT_EQ(lines.exit_code, 0) << lines.err;
  std::istringstream text(lines.out);
  int frames = 0;
  for (std::string line; std::getline(text, line); ++frames) {
    const auto frame = nlohmann::json::parse(line);
    EXPECT_EQ(frame["source"], "square");
    EXPECT_EQ(frame["frame"], frames);
    EXPECT_EQ(frame["stream_start"], frames == 0);
    EXPECT_EQ(frame["event"], "ok");
    EXPECT_EQ(frame["state"], "ok");
    EXPECT_GE(frame["unexplained"].get<double>(), 0);
  }
  EXPECT_EQ(frames, 20);
  const Outcome summary = run("square.avi --max-frames 12");
  ASSERT_EQ(summary.exit_code, 0) << summary.err;
  EXPECT_EQ(summary.out, "square  12 frames, 0 events\n");
}

TEST_F(HealthCommandLine, ACameraThatWasAwayGoesOn) {
  const Outcome lines = run("'stub:people?size=64x48&fps=50&live=1&unplug=200ms@10' --json --max-frames 20");
  ASSERT_EQ(lines.exit_code, 0) << lines.err;
  EXPECT_NE(lines.err.find("unplugged"), std::string::npos) << lines.err;
  std::istringstream text(lines.out);
  int64_t before_ns = 0;
  int frames = 0;
  for (std::string line; std::getline(text, line); ++frames) {
    const int64_t time_ns = nlohmann::json::parse(line)["timestamp_ns"];
    EXPECT_GT(time_ns, before_ns);
    before_ns = time_ns;
  }
  EXPECT_EQ(frames, 20);
}

TEST_F(HealthCommandLine, NamesTheEventsOfAClipAndDrawsThem) {
  write_clip_that_turns_black();
  const Outcome result = run("black.avi --out o/events.png");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_NE(result.out.find("1.00 s  frame 20  black\n"), std::string::npos) << result.out;
  EXPECT_NE(result.out.find("1 events -> o/events.png"), std::string::npos) << result.out;
  EXPECT_EQ(cv::imread(folder_.file("o/events.png")).size(), cv::Size(240, 180));
}

TEST_F(HealthCommandLine, DrawsTheFramesAsAClip) {
  const Outcome result = run("square.avi --max-frames 8 --out o/health.mp4");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  cv::VideoCapture clip(folder_.file("o/health.mp4"));
  int frames = 0;
  for (cv::Mat picture; clip.read(picture); ++frames) EXPECT_EQ(picture.size(), cv::Size(160, 120 + 64));
  EXPECT_EQ(frames, 8);
}

TEST_F(HealthCommandLine, WhatIsWrongIsOneSentence) {
  for (const char* wrong : {"square.avi --compare", "square.avi --max-frames 0", ""}) {
    EXPECT_EQ(run(wrong).exit_code, 2) << wrong;
  }
  expect_failure("square.avi --out images", "ends in .mp4 or .png");
  expect_failure("missing.avi", "missing.avi");
  EXPECT_NE(run("--help").out.find("maquette health clip.mp4 --out events.png"), std::string::npos);
}

}  // namespace
