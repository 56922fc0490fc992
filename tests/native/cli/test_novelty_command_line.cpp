// `maquette novelty` for its user: scores, events, clips, sentences.
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <opencv2/videoio.hpp>
#include <sstream>
#include <string>

#include "support/program_run.h"
#include "support/samples/square_clip.h"

namespace {

class NoveltyCommandLine : public ::testing::Test {
 protected:
  NoveltyCommandLine() { write_square_clip(folder_.file("square.avi")); }

  Outcome run(const std::string& arguments) const {
    return run_program(folder_, "MAQ_BUNDLE=", "novelty " + arguments);
  }
  void expect_failure(const std::string& arguments, const std::string& text) const {
    const Outcome result = run(arguments);
    EXPECT_EQ(result.exit_code, 1) << arguments;
    EXPECT_NE(result.err.find(text), std::string::npos) << result.err;
  }

  TempFolder folder_;
};

TEST_F(NoveltyCommandLine, ScoresEachFrame) {
  const Outcome lines = run("square.avi --json");
  ASSERT_EQ(lines.exit_code, 0) << lines.err;
  std::istringstream text(lines.out);
  int frames = 0;
  for (std::string line; std::getline(text, line); ++frames) {
    const auto frame = nlohmann::json::parse(line);
    EXPECT_EQ(frame["source"], "square");
    EXPECT_EQ(frame["frame"], frames);
    EXPECT_EQ(frame["stream_start"], frames == 0);
    EXPECT_GE(frame["bits"].get<double>(), 0);
    EXPECT_TRUE(frame["peak"]["x_px"].get<double>() > 0 && frame["peak"]["x_px"].get<double>() < 160);
  }
  EXPECT_EQ(frames, 20);
  const Outcome summary = run("square.avi --max-frames 12");
  ASSERT_EQ(summary.exit_code, 0) << summary.err;
  EXPECT_NE(summary.out.find("12 frames"), std::string::npos) << summary.out;
}

TEST_F(NoveltyCommandLine, ScoresACameraAlsoAfterItWasAway) {
  const Outcome lines =
      run("'stub:people?size=64x48&fps=50&live=1&unplug=200ms@10' --json --max-frames 20 --bundle "
          "'" MAQ_TEST_DATA "/tiny_prediction/bundle'");
  ASSERT_EQ(lines.exit_code, 0) << lines.err;
  EXPECT_NE(lines.err.find("unplugged"), std::string::npos) << lines.err;
  std::istringstream text(lines.out);
  int64_t before_ns = 0, longest_ns = 0;
  int frames = 0;
  for (std::string line; std::getline(text, line); ++frames) {
    const auto frame = nlohmann::json::parse(line);
    const int64_t time_ns = frame["timestamp_ns"];
    EXPECT_GT(time_ns, before_ns);
    if (frames > 0) longest_ns = std::max(longest_ns, time_ns - before_ns);
    EXPECT_TRUE(frames > 0 || frame["stream_start"]);
    before_ns = time_ns;
  }
  EXPECT_EQ(frames, 20);
  EXPECT_GT(longest_ns, 150000000) << "no line for frames that did not come";
}

TEST_F(NoveltyCommandLine, NamesTheEventsOfAClip) {
  cv::VideoWriter clip(folder_.file("cut.avi"), cv::VideoWriter::fourcc('M', 'J', 'P', 'G'), 20, {160, 120});
  cv::VideoCapture square(folder_.file("square.avi"));
  cv::Mat picture;
  for (int i = 0; i < 30; ++i) {
    if (i < 20) square.read(picture);
    if (i >= 20) picture = cv::Mat(120, 160, CV_8UC3, cv::Scalar(20, 20, 200));
    clip.write(picture);
  }
  clip.release();
  const Outcome result = run("cut.avi --threshold 6");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_NE(result.out.find("1.00 s  frame 20"), std::string::npos) << result.out;
  EXPECT_NE(result.out.find("  cut\n"), std::string::npos) << result.out;
  EXPECT_NE(result.out.find("1 events"), std::string::npos) << result.out;
}

TEST_F(NoveltyCommandLine, DrawsTheScoresAsAClip) {
  const Outcome result = run("square.avi --max-frames 8 --out o/novelty.mp4");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_NE(result.out.find(" -> o/novelty.mp4"), std::string::npos) << result.out;
  cv::VideoCapture clip(folder_.file("o/novelty.mp4"));
  int frames = 0;
  for (cv::Mat picture; clip.read(picture); ++frames) EXPECT_EQ(picture.size(), cv::Size(320, 120 + 64));
  EXPECT_EQ(frames, 8);
}

TEST_F(NoveltyCommandLine, WhatIsWrongIsOneSentence) {
  for (const char* wrong : {"square.avi --compare", "square.avi --threshold 1", "square.avi --max-frames 0"}) {
    EXPECT_EQ(run(wrong).exit_code, 2) << wrong;
  }
  expect_failure("square.avi --out images", "ends in .mp4");
  expect_failure("missing.avi", "missing.avi");
  expect_failure("square.avi --bundle nowhere", "nowhere");
  EXPECT_NE(run("--help").out.find("maquette novelty clip.mp4 --out novelty.mp4"), std::string::npos);
}

}  // namespace
