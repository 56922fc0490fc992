// `maquette predict` for its user: errors, clips, marked images, sentences.
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/videoio.hpp>
#include <string>

#include "support/program_run.h"
#include "support/samples/square_clip.h"

namespace {

class PredictCommandLine : public ::testing::Test {
 protected:
  PredictCommandLine() { write_square_clip(folder_.file("square.avi")); }

  Outcome run(const std::string& arguments) const {
    return run_program(folder_, "MAQ_BUNDLE=", "predict " + arguments);
  }
  void expect_failure(const std::string& arguments, const std::string& text) const {
    const Outcome result = run(arguments);
    EXPECT_EQ(result.exit_code, 1) << arguments;
    EXPECT_NE(result.err.find(text), std::string::npos) << result.err;
  }

  TempFolder folder_;
};

TEST_F(PredictCommandLine, ComparesTheMethodsAndDrawsThemBesideTheTruth) {
  const Outcome result = run("square.avi --from 9 --frames 6 --compare --out o/next.mp4");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_NE(result.out.find("ahead"), std::string::npos);
  EXPECT_NE(result.out.find("300 ms"), std::string::npos) << result.out;
  EXPECT_NE(result.out.find("6 predicted frames -> o/next.mp4"), std::string::npos) << result.out;
  cv::VideoCapture clip(folder_.file("o/next.mp4"));
  int frames = 0;
  cv::Mat picture;
  while (clip.read(picture)) ++frames;
  EXPECT_EQ(frames, 10 + 6) << "those seen within a second before, and those predicted";
}

TEST_F(PredictCommandLine, MotionIsNearerToTheTruthThanTheLastFrame) {
  const Outcome result = run("square.avi --from 12 --frames 5 --compare --json");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const auto document = nlohmann::json::parse(result.out);
  EXPECT_EQ(document["last_seen_frame"], 12);
  ASSERT_EQ(document["frames"].size(), 5u);
  for (const auto& frame : document["frames"]) {
    EXPECT_GT(frame["motion_fraction"].get<double>(), 0.3) << "where the square moves, not where nothing does";
    EXPECT_GT(frame["psnr_db"]["motion"].get<double>(), frame["psnr_db"]["last"].get<double>() + 3);
    EXPECT_GT(frame["psnr_db"]["chosen"].get<double>(), frame["psnr_db"]["motion"].get<double>() - 0.5);
  }
  EXPECT_NEAR(document["frames"][4]["ahead_s"].get<double>(), 0.25, 1e-6);
}

TEST_F(PredictCommandLine, PicturesInAFolderAreMarkedInside) {
  const Outcome result = run("square.avi --from 9 --frames 3 --method motion --out pictures");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  for (const char* name : {"square_ahead_001.png", "square_ahead_002.png", "square_ahead_003.png"}) {
    const std::string bytes = read_text(folder_.file(std::string("pictures/") + name));
    EXPECT_NE(bytes.find(std::string("predicted\0maquette horizon_ns=", 29)), std::string::npos) << name;
    EXPECT_EQ(cv::imread(folder_.file(std::string("pictures/") + name)).size(), cv::Size(160, 120));
  }
}

TEST_F(PredictCommandLine, PredictedFramesOfAClipHaveABorder) {
  const Outcome result = run("square.avi --from 4 --frames 2 --out next.mp4");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  cv::VideoCapture clip(folder_.file("next.mp4"));
  cv::Mat picture;
  for (int i = 0; i < 7; ++i) {
    ASSERT_TRUE(clip.read(picture));
    const cv::Vec3b edge = picture.at<cv::Vec3b>(60, 0);
    const bool is_magenta = edge[0] > 150 && edge[1] < 110 && edge[2] > 150;
    EXPECT_EQ(is_magenta, i >= 5) << i;
  }
}

TEST_F(PredictCommandLine, SamplesOfOneSeedAreTheSameAndShownBesideTheTruth) {
  const std::string drawn =
      "square.avi --from 9 --frames 2 --samples 2 --seed 5 --bundle '" MAQ_TEST_DATA "/tiny_transformer/bundle' ";
  const auto figures = [&](const std::string& arguments) {
    const Outcome result = run(drawn + "--compare --json " + arguments);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return nlohmann::json::parse(result.out)["frames"];
  };
  const auto first = figures("--out row.mp4");
  ASSERT_EQ(first.size(), 2u);
  for (const auto& frame : first) {
    ASSERT_EQ(frame["psnr_db"]["samples"].size(), 2u);
    EXPECT_NE(frame["psnr_db"]["samples"][0], frame["psnr_db"]["samples"][1]);
    EXPECT_GT(frame["entropy_bits"].get<double>(), 0.1);
  }
  cv::VideoCapture clip(folder_.file("row.mp4"));
  cv::Mat picture;
  ASSERT_TRUE(clip.read(picture));
  EXPECT_EQ(picture.cols, 7 * 160) << "truth, last, motion, auto, two samples, entropy";
  const auto samples_of = [](const nlohmann::json& frames) {
    std::vector<nlohmann::json> found;
    for (const auto& frame : frames) found.push_back(frame["psnr_db"]["samples"]);
    return found;
  };
  EXPECT_EQ(samples_of(figures("")), samples_of(first));
  EXPECT_NE(samples_of(figures("--temperature 0")), samples_of(first));
  ASSERT_EQ(run(drawn + "--out pictures").exit_code, 0);
  for (const char* name : {"square_ahead_001_sample_01.png", "square_ahead_002_sample_02.png"}) {
    EXPECT_NE(read_text(folder_.file(std::string("pictures/") + name)).find("maquette horizon_ns="), std::string::npos);
  }
  for (const char* wrong :
       {"--samples 17", "--samples 2 --temperature -1", "--seed 3", "--method motion --temperature 3"}) {
    EXPECT_EQ(run(std::string("square.avi --compare ") + wrong).exit_code, 2) << wrong;
  }
  expect_failure("square.avi --compare --frames 65 --samples 1", "--frames 64");
}

TEST_F(PredictCommandLine, AComparisonThatNoFrameTakesIsDrawnSmaller) {
  const Outcome rows = run("'stub:people?size=5000x64&fps=30' --from 2 --frames 1 --compare --out rows");
  ASSERT_EQ(rows.exit_code, 0) << rows.err;
  EXPECT_EQ(cv::imread(folder_.file("rows/stub_people_ahead_001.png")).cols, 4 * 4096);
}

TEST_F(PredictCommandLine, AfterTheEndThereIsNothingToCompareWith) {
  const Outcome result = run("square.avi --from 18 --frames 3 --compare");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_NE(result.out.find("no frame to compare with"), std::string::npos) << result.out;
}

TEST_F(PredictCommandLine, PlayConcealsAStallAndCountsWhatItMadeUp) {
  const std::string stub = "'stub:people?size=160x120&fps=30&stall=300ms@30&live=1' --no-image --frames 45";
  const Outcome bridged = run_program(folder_, "MAQ_BUNDLE=", "play " + stub + " --conceal --json a.json");
  ASSERT_EQ(bridged.exit_code, 0) << bridged.err;
  EXPECT_NE(bridged.out.find("predicted frames"), std::string::npos) << bridged.out;
  const auto report = nlohmann::json::parse(read_text(folder_.file("a.json")));
  EXPECT_EQ(report["frames"], 45) << "captured ones";
  EXPECT_GE(report["concealed"]["predicted_frames"].get<int>(), 4);
  EXPECT_LE(report["concealed"]["predicted_frames"].get<int>(), 20);
  const Outcome plain = run_program(folder_, "MAQ_BUNDLE=", "play " + stub + " --json b.json");
  ASSERT_EQ(plain.exit_code, 0) << plain.err;
  EXPECT_FALSE(nlohmann::json::parse(read_text(folder_.file("b.json"))).contains("concealed"));
}

TEST_F(PredictCommandLine, WhatIsWrongIsOneSentence) {
  expect_failure("square.avi", "--out");
  expect_failure("square.avi --from 20 --compare", "has 20 frames, but --from is 20");
  expect_failure("missing.avi --compare", "does not exist");
  expect_failure("square.avi --compare --out next.gif", "ends in .gif");
  EXPECT_NE(run("square.avi --compare --method latent").exit_code, 0);
  EXPECT_NE(run("--help").out.find("maquette predict clip.mp4 --from 40"), std::string::npos);
}

}  // namespace
