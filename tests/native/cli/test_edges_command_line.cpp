// `maquette edges` as a person meets it: files, overlays, sentences.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/videoio.hpp>
#include <set>

#include "support/program_run.h"

namespace {

class EdgesCommandLine : public ::testing::Test {
 protected:
  EdgesCommandLine() {
    cv::Mat depth(30, 40, CV_16UC1, cv::Scalar(1500));
    depth(cv::Rect(10, 8, 12, 10)) = 900;
    depth(cv::Rect(0, 0, 5, 30)) = 0;
    cv::imwrite(folder_.file("depth.png"), depth);
    cv::imwrite(folder_.file("grey.png"), cv::Mat(30, 40, CV_8UC1, cv::Scalar(100)));
  }

  Outcome run(const std::string& arguments) const { return run_program(folder_, environment_, "edges " + arguments); }
  // Exit code 1, and the last line on standard error is one sentence with `text`.
  void expect_failure(const std::string& arguments, const std::string& text) const {
    const Outcome result = run(arguments);
    EXPECT_EQ(result.exit_code, 1) << arguments;
    const size_t last = result.err.rfind("maquette: ");
    ASSERT_NE(last, std::string::npos) << result.err;
    EXPECT_NE(result.err.find(text, last), std::string::npos) << result.err;
    EXPECT_EQ(result.err.find('\n', last), result.err.size() - 1) << result.err;
  }
  std::set<std::string> files(const std::string& folder) const {
    std::set<std::string> names;
    if (!std::filesystem::exists(folder_.file(folder))) return names;
    for (const auto& entry : std::filesystem::directory_iterator(folder_.file(folder))) {
      names.insert(entry.path().filename().string());
    }
    return names;
  }
  cv::Mat image(const std::string& name) const { return cv::imread(folder_.file(name), cv::IMREAD_UNCHANGED); }

  TempFolder folder_;
  std::string environment_ = "MAQ_BUNDLE= MAQ_EDGES_BUNDLE='" MAQ_TEST_DATA "/tiny_edges/bundle'";
};

TEST_F(EdgesCommandLine, ADepthPictureGivesItsFieldAndAnOverlay) {
  const Outcome result = run("'image:depth.png?depth_unit=0.001&fov=60' --out o/p --overlay");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(result.out.rfind("depth  40 x 30  depth of 88 %", 0), 0u) << result.out;
  EXPECT_EQ(files("o/p"),
            (std::set<std::string>{"depth_distance.png", "depth_kind.png", "depth_edges.json", "depth_overlay.png"}));
  const cv::Mat distance = image("o/p/depth_distance.png"), kind = image("o/p/depth_kind.png");
  ASSERT_EQ(distance.type(), CV_16UC1);
  ASSERT_EQ(kind.type(), CV_8UC1);
  for (int y = 0; y < 30; ++y) {
    for (int x = 0; x < 40; ++x) {
      ASSERT_LE(distance.at<uint16_t>(y, x), 16000);
      ASSERT_TRUE(x >= 5 || distance.at<uint16_t>(y, x) == 16000) << "nothing is known there";
      ASSERT_EQ(kind.at<uint8_t>(y, x) == 0, distance.at<uint16_t>(y, x) == 16000) << x << " " << y;
    }
  }
  const cv::Mat overlay = image("o/p/depth_overlay.png");
  EXPECT_EQ(overlay.size(), cv::Size(160, 120)) << "small pictures are enlarged";
  EXPECT_EQ(overlay.at<cv::Vec3b>(60, 8), cv::Vec3b(0, 0, 0)) << "unknown is black";
  EXPECT_NE(overlay.at<cv::Vec3b>(60, 120), cv::Vec3b(0, 0, 0));
  const auto document = nlohmann::json::parse(read_text(folder_.file("o/p/depth_edges.json")));
  EXPECT_NEAR(document["intrinsics"]["fx_px"].get<double>(), 20 / std::tan(30 * 3.14159265358979 / 180), 1e-6);
}

TEST_F(EdgesCommandLine, AStubGivesFramesAndAClip) {
  const Outcome result =
      run("'stub:solids?scene=box&noise=stereo&size=160x120' --out o --overlay --max-frames 4 --every 2 --json "
          "--threads measured");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  std::istringstream lines(result.out);
  std::string line;
  std::vector<nlohmann::json> frames;
  while (std::getline(lines, line)) frames.push_back(nlohmann::json::parse(line));
  ASSERT_EQ(frames.size(), 4u);
  EXPECT_EQ(frames[1]["frame"], "stub_solids_000002");
  EXPECT_EQ(frames[1]["size"], (nlohmann::json{160, 120}));
  EXPECT_GT(frames[1]["known_pixels"], 1000);
  EXPECT_EQ(frames[1]["network_pixels"], 160 * 120);
  EXPECT_EQ(frames[1]["broken_pixels"], 0);
  EXPECT_GE(frames[1]["threads"], 1);
  EXPECT_EQ(frames[1]["threads_measured"], true);
  EXPECT_GE(frames[1]["ms"]["total"], frames[1]["ms"]["network"]);
  EXPECT_EQ(files("o").size(), 4u * 3 + 1);
  EXPECT_TRUE(files("o").count("stub_solids_overlay.mp4") == 1);
}

TEST_F(EdgesCommandLine, CurvesAreWrittenInEachFormatAndBoxesAreMeasured) {
  environment_ = "MAQ_BUNDLE= MAQ_EDGES_BUNDLE='" MAQ_TEST_MODELS "/edges-int8'";
  const std::string source = "'stub:solids?scene=box&seed=1&fps=1&size=640x480&frames=4' --out o --boxes";
  const Outcome result = run(source + " --format json,obj --format dxf,ply,step --overlay --json");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  std::istringstream lines(result.out);
  std::string line;
  size_t count = 0, boxes = 0;
  for (; std::getline(lines, line); ++count) {
    const auto frame = nlohmann::json::parse(line);
    const std::string stem = "o/" + frame["frame"].get<std::string>();
    const auto curves = nlohmann::json::parse(read_text(folder_.file(stem + "_curves.json")));
    EXPECT_EQ(curves["curves"].size(), frame["curves"]);
    EXPECT_EQ(curves["corners"].size(), frame["corners"]);
    EXPECT_GT(frame["ms"]["curves"], 0);
    for (const char* ending : {"obj", "ply", "dxf", "step"}) {
      EXPECT_GT(std::filesystem::file_size(folder_.file(stem + "_curves." + ending)), 100u);
    }
    for (const auto& box : frame["boxes"]) {
      ++boxes;
      EXPECT_NEAR(box["size_m"][0].get<double>(), 0.441, 0.04);
      EXPECT_GT(box["size_tolerance_m"][2], 0);
      EXPECT_EQ(box["includes_focal_tolerance"], false);
    }
  }
  EXPECT_EQ(count, 4u);
  EXPECT_GE(boxes, 1u);
  const Outcome text = run(source + " --overlay");
  ASSERT_EQ(text.exit_code, 0) << text.err;
  EXPECT_NE(text.out.find(" curves, "), std::string::npos) << text.out;
  EXPECT_NE(text.out.find("  box of 4"), std::string::npos) << text.out;
}

TEST_F(EdgesCommandLine, TheBundledDepthPictureGivesTheSizeOfItsCarton) {
  environment_ = "MAQ_BUNDLE= MAQ_EDGES_BUNDLE='" MAQ_TEST_MODELS "/edges-int8'";
  std::filesystem::create_directory_symlink(MAQ_TEST_MEDIA "/..", folder_.file("tests"));
  const auto truth = nlohmann::json::parse(read_text(MAQ_TEST_MEDIA "/box_depth.json"));
  const Outcome result = run("'" + truth["source"].get<std::string>() + "' --out o --boxes --json");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const auto boxes = nlohmann::json::parse(result.out)["boxes"];
  ASSERT_EQ(boxes.size(), 1u);
  for (size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(boxes[0]["size_m"][i].get<double>(), truth["size_m"][i].get<double>(), 0.02);
  }
}

TEST_F(EdgesCommandLine, AWrongUnitIsAWarningAndTheToleranceSaysWhetherTheFocalLengthIsIn) {
  environment_ = "MAQ_BUNDLE= MAQ_EDGES_BUNDLE='" MAQ_TEST_MODELS "/edges-int8'";
  std::filesystem::create_directory_symlink(MAQ_TEST_MEDIA "/..", folder_.file("tests"));
  std::string source = nlohmann::json::parse(read_text(MAQ_TEST_MEDIA "/box_depth.json"))["source"];
  const Outcome sure = run("'" + source + "' --boxes");
  EXPECT_NE(sure.out.find(" mm if the focal length is exact"), std::string::npos) << sure.out;
  EXPECT_EQ(sure.err.find("unit"), std::string::npos) << sure.err;
  const Outcome unsure = run("'" + source + "' --boxes --focal-tolerance 2");
  EXPECT_NE(unsure.out.find(" mm\n"), std::string::npos) << unsure.out;
  const size_t unit = source.find("depth_unit=");
  ASSERT_NE(unit, std::string::npos);
  source.replace(unit, source.find('&', unit) - unit, "depth_unit=1");
  const Outcome wrong = run("'" + source + "' --boxes --json");
  EXPECT_EQ(wrong.exit_code, 0);
  EXPECT_NE(wrong.err.find("% is beyond 50 m, so its unit is probably wrong"), std::string::npos) << wrong.err;
  EXPECT_GT(nlohmann::json::parse(wrong.out)["far_pixels"], 0);
}

TEST_F(EdgesCommandLine, AWrongFormatNothingToDoAndTheNetworkAreToldInWords) {
  const Outcome wrong = run("'image:depth.png?depth_unit=0.001&fov=60' --out o --format stl");
  EXPECT_EQ(wrong.exit_code, 2);
  EXPECT_NE(wrong.err.find("stl"), std::string::npos) << wrong.err;
  EXPECT_EQ(run("").exit_code, 2);
  EXPECT_NE(run("").err.find("source"), std::string::npos) << run("").err;
  const Outcome info = run("info");
  ASSERT_EQ(info.exit_code, 0) << info.err;
  EXPECT_NE(info.out.find("up to 16 r"), std::string::npos) << info.out;
  const Outcome json = run("info --json --bundle '" MAQ_TEST_MODELS "/edges-int8'");
  EXPECT_EQ(nlohmann::json::parse(json.out)["name"], "edges-int8");
  expect_failure("info --bundle /nowhere", "/nowhere");
}

TEST_F(EdgesCommandLine, WhatHasNoDepthNoCalibrationOrNoBundleIsASentence) {
  expect_failure("grey.png --out o", "fov=60");
  expect_failure("'image:depth.png?depth_unit=0.001' --out o", "image:depth.png?depth_unit=0.001&fov=60");
  expect_failure("'image:grey.png?fov=60' --out o", "depth_unit");
  expect_failure("'image:grey.png?fov=60&depth_unit=0.001' --out o", "grey.png");
  expect_failure("missing.png --out o", "missing.png");
  expect_failure("'image:depth.png?depth_unit=0.001&fov=60' --out o --bundle " MAQ_TEST_DATA "/tiny_bundle",
                 "densepose");
  EXPECT_EQ(files("o"), std::set<std::string>()) << "nothing is half written";
}

TEST_F(EdgesCommandLine, WithoutAFolderResultsAreOnlyPrinted) {
  const std::string source = "'image:depth.png?depth_unit=0.001&fov=60' ";
  run(source);
  const auto before = files("");  // with the files that hold the output of a run
  const Outcome printed = run(source + "--boxes");
  EXPECT_EQ(printed.exit_code, 0) << printed.err;
  EXPECT_NE(printed.out.find("box"), std::string::npos) << printed.out;
  EXPECT_EQ(files(""), before);
  for (const char* needs_folder : {"--overlay", "--format step"}) {
    const Outcome wrong = run(source + needs_folder);
    EXPECT_EQ(wrong.exit_code, 2);
    EXPECT_NE(wrong.err.find("--out"), std::string::npos) << wrong.err;
  }
}

// Cut files, a head that promises more pixels than there is memory for, a focal length of 0, a file where the folder
// should be: a sentence, and nothing is written.
TEST_F(EdgesCommandLine, DamagedDepthAndBadNumbersAreASentence) {
  const std::string whole = read_text(folder_.file("depth.png"));
  for (const size_t bytes : {size_t(0), size_t(7), size_t(30), whole.size() / 2}) {
    write_text(folder_.file("cut.png"), whole.substr(0, bytes));
    expect_failure("'image:cut.png?depth_unit=0.001&fov=60' --out o", "cut.png");
  }
  std::string giant = whole;
  for (const size_t at : {16u, 20u}) giant.replace(at, 4, std::string("\x00\x0f\x00\x00", 4));
  write_text(folder_.file("giant.png"), giant);
  expect_failure("'image:giant.png?depth_unit=0.001&fov=60' --out o", "giant.png");
  for (const char* given :
       {"fx=0", "fx=-5", "fx=nan", "fov=0", "fov=180", "depth_unit=0&fov=60", "depth_unit=x&fov=60"}) {
    const std::string unit = std::string(given).find("depth_unit") == 0 ? "" : "depth_unit=0.001&";
    EXPECT_NE(run("'image:depth.png?" + unit + given + "' --out o").exit_code, 0) << given;
  }
  EXPECT_EQ(files("o"), std::set<std::string>());
  write_text(folder_.file("file"), "here already");
  EXPECT_NE(run("'image:depth.png?depth_unit=0.001&fov=60' --out file").exit_code, 0);
  EXPECT_EQ(read_text(folder_.file("file")), "here already");
}

TEST_F(EdgesCommandLine, ABadSourceDoesNotCostTheRest) {
  const Outcome result =
      run("'image:grey.png?fov=60&depth_unit=0.001' 'image:depth.png?depth_unit=0.001&fov=60' --out o");
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_NE(result.err.find("grey.png"), std::string::npos);
  EXPECT_EQ(files("o").count("depth_distance.png"), 1u);
}

TEST_F(EdgesCommandLine, HelpSaysWhatIsWrittenAndHowDepthIsGiven) {
  const Outcome result = run("--help");
  EXPECT_EQ(result.exit_code, 0);
  for (const char* text : {"<stem>_distance.png", "<stem>_curves.<format>", "depth_unit=0.001", "fov=60", "stub:solids",
                           "--boxes", "json, obj, ply, dxf or step", "edges info"}) {
    EXPECT_NE(result.out.find(text), std::string::npos) << text;
  }
}

}  // namespace
