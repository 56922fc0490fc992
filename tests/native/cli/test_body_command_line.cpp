// `maquette body` as a person meets it: files, what is printed, sentences.
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <sstream>

#include "support/program_run.h"

namespace {

class BodyCommandLine : public ::testing::Test {
 protected:
  Outcome run(const std::string& arguments) const { return run_program(folder_, environment_, "body " + arguments); }
  bool exists(const std::string& name) const { return std::filesystem::exists(folder_.file(name)); }

  TempFolder folder_;
  std::string environment_ =
      "MAQ_BUNDLE='" MAQ_TEST_MODELS "/densepose-b-int8' MAQ_BODY_BUNDLE='" MAQ_TEST_MODELS "/body'";
};

TEST_F(BodyCommandLine, AClipBecomesAnAnimatedGlbAndBvhOfEachPerson) {
  const Outcome result = run("'stub:people?count=2&seed=3' --max-frames 12 --out o/dance.glb --bvh o/dance.bvh");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_NE(result.out.find("12 frames, "), std::string::npos) << result.out;
  EXPECT_NE(result.out.find("-> o/dance.glb"), std::string::npos) << result.out;
  const std::string glb = read_text(folder_.file("o/dance.glb"));
  EXPECT_EQ(glb.substr(0, 4), "glTF");
  EXPECT_NE(glb.find("\"animations\""), std::string::npos);
  EXPECT_EQ(read_text(folder_.file("o/dance.bvh")).substr(0, 9), "HIERARCHY");
  EXPECT_TRUE(exists("o/dance_2.bvh"));
}

TEST_F(BodyCommandLine, APhotoIsOneStaticBodyWithItsAngles) {
  const Outcome result = run("'" MAQ_TEST_MEDIA "/photo.jpg' --out photo.glb");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_NE(result.out.find("\"left_elbow\":"), std::string::npos) << result.out;
  EXPECT_EQ(read_text(folder_.file("photo.glb")).find("\"animations\""), std::string::npos);
}

TEST_F(BodyCommandLine, SizesAreATableWithIntervalsThatAHeightNarrows) {
  const Outcome unknown = run("'" MAQ_TEST_MEDIA "/photo.jpg' --out a.glb");
  ASSERT_EQ(unknown.exit_code, 0) << unknown.err;
  EXPECT_NE(unknown.out.find("size, cm  height"), std::string::npos) << unknown.out;
  EXPECT_NE(unknown.out.find("--height narrows"), std::string::npos) << unknown.out;
  EXPECT_NE(unknown.out.find(" to "), std::string::npos) << unknown.out;
  const Outcome known = run("'" MAQ_TEST_MEDIA "/photo.jpg' --out a.glb --height 1.65");
  ASSERT_EQ(known.exit_code, 0) << known.err;
  EXPECT_NE(known.out.find("  165  "), std::string::npos) << known.out;
  EXPECT_EQ(known.out.find("--height narrows"), std::string::npos) << known.out;
  const Outcome json = run("'" MAQ_TEST_MEDIA "/photo.jpg' --json --height 1.65");
  ASSERT_EQ(json.exit_code, 0) << json.err;
  const auto sizes = nlohmann::json::parse(json.out)["people"][0]["sizes_m"];
  EXPECT_EQ(sizes["is_height_known"], true);
  EXPECT_EQ(sizes["height"]["value"], 1.65);
  EXPECT_LT(sizes["waist"]["low"].get<double>(), sizes["waist"]["value"].get<double>());
}

TEST_F(BodyCommandLine, JsonHasALineForEachFrameWithKeypointsAndAngles) {
  const Outcome result = run("'stub:people?count=1&seed=3' --max-frames 3 --json --focal-length 600");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  std::istringstream lines(result.out);
  int count = 0;
  for (std::string line; std::getline(lines, line); ++count) {
    const auto frame = nlohmann::json::parse(line);
    for (const auto& person : frame["people"]) {
      if (!person["is_fitted"]) continue;
      EXPECT_EQ(person["keypoints_m"].size(), 99u);
      EXPECT_TRUE(person["angles_deg"]["left_knee"].is_number());
    }
  }
  EXPECT_EQ(count, 3);
}

TEST_F(BodyCommandLine, WhatCannotBeDoneIsASentence) {
  const auto expect_error = [&](const std::string& arguments, const char* text) {
    const Outcome result = run(arguments);
    EXPECT_NE(result.exit_code, 0) << arguments;
    EXPECT_NE(result.err.find(text), std::string::npos) << result.err;
  };
  expect_error("'" MAQ_TEST_MEDIA "/photo.jpg'", "give --out body.glb, --bvh body.bvh or --json");
  expect_error("'stub:grey' --out a.glb", "stub:grey");
  expect_error("'stub:pattern' --max-frames 2 --out a.glb", "nothing was written");
  EXPECT_FALSE(exists("a.glb"));
  expect_error("'" MAQ_TEST_MEDIA "/photo.jpg' --out a.obj", "must end with .glb");
  expect_error("'" MAQ_TEST_MEDIA "/photo.jpg' --out a.glb --body-bundle none", "none");
  expect_error("'" MAQ_TEST_MEDIA "/photo.jpg' --out a.glb --height 178", "1.3");
}

}  // namespace
