// `maquette predict` as a person meets it: figures, clips, marked pictures, sentences.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/videoio.hpp>
#include <sstream>
#include <string>

#include "support/program_run.h"

namespace {

class PredictCommandLine : public ::testing::Test {
 protected:
  // A textured square that moves by 4 pixels a frame over a texture that stands still.
  PredictCommandLine() {
    cv::VideoWriter clip(folder_.file("square.avi"), cv::VideoWriter::fourcc('M', 'J', 'P', 'G'), 20, {160, 120});
    for (int i = 0; i < 20; ++i) {
      cv::Mat picture(120, 160, CV_8UC3);
      for (int y = 0; y < picture.rows; ++y) {
        for (int x = 0; x < picture.cols; ++x) {
          const double u = x - 10 - 4 * i, v = y - 30;
          const bool is_thing = u >= 0 && u < 48 && v >= 0 && v < 48;
          const double value = is_thing ? 170 + 60 * std::sin(0.5 * u) * std::sin(0.4 * v)
                                        : 90 + 40 * std::sin(0.3 * x) * std::sin(0.2 * y);
          picture.at<cv::Vec3b>(y, x) = cv::Vec3b::all(uint8_t(value));
        }
      }
      clip.write(picture);
    }
  }

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
  const Outcome result = run("square.avi --from 9 --frames 6 --compare --out o/next.avi");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_NE(result.out.find("ahead"), std::string::npos);
  EXPECT_NE(result.out.find("300 ms"), std::string::npos) << result.out;
  EXPECT_NE(result.out.find("6 predicted frames -> o/next.avi"), std::string::npos) << result.out;
  cv::VideoCapture clip(folder_.file("o/next.avi"));
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

TEST_F(PredictCommandLine, ANetworkChangesWhatAutoHas) {
  const auto figures = [&](const std::string& arguments) {
    const Outcome result = run("square.avi --from 12 --frames 2 --compare --json " + arguments);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return nlohmann::json::parse(result.out);
  };
  const auto mended = figures("--method network --out row.avi --bundle '" MAQ_TEST_DATA "/tiny_transformer/bundle'");
  EXPECT_EQ(mended["method"], "network");
  EXPECT_NE(mended["frames"][0]["psnr_db"]["chosen"], figures("")["frames"][0]["psnr_db"]["chosen"]);
  cv::VideoCapture clip(folder_.file("row.avi"));
  EXPECT_EQ(clip.get(cv::CAP_PROP_FRAME_WIDTH), 4 * 160) << "truth, last, motion and that";
  expect_failure("square.avi --compare --method network --bundle '" MAQ_TEST_DATA "/tiny_prediction/bundle'",
                 "no networks that foresee pictures");
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
  const Outcome result = run("square.avi --from 4 --frames 2 --out next.avi");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  cv::VideoCapture clip(folder_.file("next.avi"));
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
  const auto first = figures("--out row.avi");
  ASSERT_EQ(first.size(), 2u);
  for (const auto& frame : first) {
    ASSERT_EQ(frame["psnr_db"]["samples"].size(), 2u);
    EXPECT_NE(frame["psnr_db"]["samples"][0], frame["psnr_db"]["samples"][1]);
    EXPECT_GT(frame["uncertainty_bits"].get<double>(), 0.1);
  }
  cv::VideoCapture clip(folder_.file("row.avi"));
  cv::Mat picture;
  ASSERT_TRUE(clip.read(picture));
  EXPECT_EQ(picture.cols, 7 * 160) << "truth, last, motion, auto, two samples, uncertainty";
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
  for (const char* wrong : {"--samples 17", "--samples 2 --temperature -1", "--samples 2 --passes 17", "--seed 3",
                            "--samples 2 --surprise"}) {
    EXPECT_EQ(run(std::string("square.avi --compare ") + wrong).exit_code, 2) << wrong;
  }
  expect_failure("square.avi --compare --frames 65 --samples 1", "--frames 64");
}

TEST_F(PredictCommandLine, AComparisonThatNoClipTakesIsDrawnSmaller) {
  const Outcome result =
      run("'stub:people?size=2652x64&fps=30' --from 2 --frames 1 --compare --out wide.mp4");  // 10,608 pixels in a row
  ASSERT_EQ(result.exit_code, 0) << result.err;
  cv::VideoCapture clip(folder_.file("wide.mp4"));
  cv::Mat picture;
  ASSERT_TRUE(clip.read(picture));
  EXPECT_EQ(picture.size(), cv::Size(8188, 48));
  ASSERT_EQ(run("'stub:people?size=9000x64&fps=30' --from 2 --frames 1 --out alone.mp4").exit_code, 0);
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
  const std::string stub = "'stub:people?size=160x120&fps=30&stall=300ms@30&live=1' --no-picture --frames 45";
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

TEST_F(PredictCommandLine, BenchMeasuresEachStageOfWhatIsPredicted) {
  const std::string bundle = " --bundle '" MAQ_TEST_DATA "/tiny_transformer/bundle' --runs 2 --seconds 0 --warm-up 0 ";
  const Outcome result = run_program(folder_, "MAQ_BUNDLE=", "bench --predict square.avi --json b.json" + bundle);
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_NE(result.out.find("4 samples take "), std::string::npos) << result.out;
  const auto document = nlohmann::json::parse(read_text(folder_.file("b.json")));
  EXPECT_EQ(document["schema"], "maquette-bench-prediction-1");
  EXPECT_EQ(document["valid"], document["warnings"].empty());
  EXPECT_TRUE(document["left_out"].empty()) << document["left_out"];
  EXPECT_NEAR(document["settings"]["step_s"].get<double>(), 0.05, 1e-6);
  EXPECT_GT(document["four_samples_times"].get<double>(), 0);
  std::vector<std::string> names;
  for (const auto& timed : document["cases"]) {
    names.push_back(timed["name"]);
    const bool is_drawn = timed.contains("samples");
    EXPECT_EQ(timed["size_px"], is_drawn ? nlohmann::json({64, 64}) : nlohmann::json({160, 120})) << timed["name"];
    EXPECT_GE(timed["runs"], 2);
    double stages = 0;
    for (const auto& [name, ms] : timed["ms"].items()) {
      EXPECT_LE(ms["p50"], ms["p99"]) << name;
      if (name != "frame") stages += ms["p50"].get<double>();
    }
    EXPECT_GT(stages, 0);
    EXPECT_LT(stages, 1.5 * timed["ms"]["frame"]["p90"].get<double>()) << timed["name"];
    for (const auto& warning : timed["warnings"]) {
      EXPECT_EQ(warning.get<std::string>().find("nothing moved"), std::string::npos) << "the square does";
    }
  }
  EXPECT_EQ(names.size(), 10u);
  EXPECT_EQ(names.front(), "surprise");
}

TEST_F(PredictCommandLine, BenchSaysWhatItCannotMeasure) {
  const auto bench = [&](const std::string& arguments) {
    return run_program(folder_, "MAQ_BUNDLE=", "bench --predict --runs 1 --seconds 0 --warm-up 0 " + arguments);
  };
  const Outcome table_alone = bench("square.avi --bundle '" MAQ_TEST_DATA "/tiny_prediction/bundle'");
  EXPECT_EQ(table_alone.exit_code, 0) << table_alone.err;
  EXPECT_NE(table_alone.out.find("Frames are not drawn: "), std::string::npos) << table_alone.out;
  EXPECT_EQ(table_alone.out.find("next drawn"), std::string::npos) << table_alone.out;
  const cv::Mat grey(48, 64, CV_8UC3, cv::Scalar::all(90));
  cv::VideoWriter clip(folder_.file("still.avi"), cv::VideoWriter::fourcc('M', 'J', 'P', 'G'), 20, grey.size());
  for (int i = 0; i < 16; ++i) clip.write(grey);
  clip.release();
  const Outcome still = bench("still.avi --bundle '" MAQ_TEST_DATA "/tiny_transformer/bundle'");
  EXPECT_NE(still.out.find("nothing moved in 10 frames, so that no network ran"), std::string::npos) << still.out;
  cv::imwrite(folder_.file("photo.png"), grey);
  for (const auto& [arguments, text] : {std::pair{"photo.png", "photo has 1 of the 16 frames"},
                                        {"square.avi square.avi", "one source"},
                                        {"square.avi --threads measured", "--threads, 1 to 64"},
                                        {"square.avi --bundle nowhere", "nowhere"}}) {
    const Outcome result = bench(arguments);
    EXPECT_EQ(result.exit_code, 1) << arguments;
    EXPECT_NE(result.err.find(text), std::string::npos) << result.err;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
  }
  EXPECT_EQ(bench("square.avi --key-frames 2").exit_code, 2) << "of dense pose";
  EXPECT_NE(bench("--help").out.find("maquette bench --predict clip.mp4"), std::string::npos);
}

TEST_F(PredictCommandLine, WhatIsWrongIsOneSentence) {
  expect_failure("square.avi", "--out");
  expect_failure("square.avi --from 20 --compare", "has 20 frames, but --from is 20");
  expect_failure("missing.avi --compare", "does not exist");
  expect_failure("square.avi --compare --out next.gif", "ends in .gif");
  EXPECT_NE(run("square.avi --compare --method latent").exit_code, 0);
  EXPECT_NE(run("--help").out.find("maquette predict clip.mp4 --from 40"), std::string::npos);
}

TEST_F(PredictCommandLine, SaysHowSurprisingFramesAre) {
  const Outcome lines = run("square.avi --surprise --json");
  ASSERT_EQ(lines.exit_code, 0) << lines.err;
  std::istringstream text(lines.out);
  int frames = 0;
  for (std::string line; std::getline(text, line); ++frames) {
    const auto frame = nlohmann::json::parse(line);
    EXPECT_EQ(frame["source"], "square");
    EXPECT_EQ(frame["frame"], frames);
    EXPECT_EQ(frame["start"], frames == 0);
    EXPECT_GE(frame["bits"].get<double>(), 0);
    EXPECT_TRUE(frame["peak"]["x_px"].get<double>() > 0 && frame["peak"]["x_px"].get<double>() < 160);
  }
  EXPECT_EQ(frames, 20);
  const Outcome summary = run("square.avi --surprise --max-frames 12");
  ASSERT_EQ(summary.exit_code, 0) << summary.err;
  EXPECT_NE(summary.out.find("12 frames"), std::string::npos) << summary.out;
}

TEST_F(PredictCommandLine, SaysHowSurprisingACameraIsAlsoWhenItWasAway) {
  const Outcome lines =
      run("'stub:people?size=64x48&fps=50&live=1&unplug=200ms@10' --surprise --json --max-frames 20 --bundle "
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
    EXPECT_TRUE(frames > 0 || frame["start"]);
    before_ns = time_ns;
  }
  EXPECT_EQ(frames, 20);
  EXPECT_GT(longest_ns, 150000000) << "no line for frames that did not come";
}

TEST_F(PredictCommandLine, NamesTheEventsOfAClip) {
  cv::VideoWriter clip(folder_.file("cut.avi"), cv::VideoWriter::fourcc('M', 'J', 'P', 'G'), 20, {160, 120});
  cv::VideoCapture square(folder_.file("square.avi"));
  cv::Mat picture;
  for (int i = 0; i < 30; ++i) {
    if (i < 20) square.read(picture);
    if (i >= 20) picture = cv::Mat(120, 160, CV_8UC3, cv::Scalar(20, 20, 200));
    clip.write(picture);
  }
  clip.release();
  const Outcome result = run("cut.avi --surprise --events 6");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_NE(result.out.find("1.00 s  frame 20"), std::string::npos) << result.out;
  EXPECT_NE(result.out.find("  cut\n"), std::string::npos) << result.out;
  EXPECT_NE(result.out.find("1 events"), std::string::npos) << result.out;
}

TEST_F(PredictCommandLine, DrawsSurpriseAsAClip) {
  const Outcome result = run("square.avi --surprise --max-frames 8 --out o/surprise.avi");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_NE(result.out.find(" -> o/surprise.avi"), std::string::npos) << result.out;
  cv::VideoCapture clip(folder_.file("o/surprise.avi"));
  int frames = 0;
  for (cv::Mat picture; clip.read(picture); ++frames) EXPECT_EQ(picture.size(), cv::Size(320, 120 + 64));
  EXPECT_EQ(frames, 8);
}

TEST_F(PredictCommandLine, SurpriseAndPicturesDoNotMix) {
  for (const char* wrong :
       {"square.avi --surprise --compare", "square.avi --events 6", "square.avi --surprise --events 1",
        "square.avi --surprise --max-frames 0", "square.avi --surprise --from 3"}) {
    EXPECT_EQ(run(wrong).exit_code, 2) << wrong;
  }
  expect_failure("square.avi --surprise --out pictures", "ends in .mp4 or .avi");
  expect_failure("missing.avi --surprise", "missing.avi");
  expect_failure("square.avi --surprise --bundle nowhere", "nowhere");
}

}  // namespace
