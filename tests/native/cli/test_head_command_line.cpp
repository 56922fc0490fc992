// `maquette head` as a person meets it: files, what is printed, sentences.
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/videoio.hpp>
#include <sstream>

#include "support/program_run.h"

namespace {

class HeadCommandLine : public ::testing::Test {
 protected:
  HeadCommandLine() {
    cv::imwrite(folder_.file("grey.png"), cv::Mat(240, 320, CV_8UC3, cv::Scalar(120, 130, 140)));
    cv::imwrite(folder_.file("blue.png"), cv::Mat(240, 320, CV_8UC3, cv::Scalar(200, 60, 20)));
    cv::imwrite(folder_.file("black.png"), cv::Mat(240, 320, CV_8UC3, cv::Scalar(0, 0, 0)));
  }

  Outcome run(const std::string& arguments) const { return run_program(folder_, environment_, "head " + arguments); }
  void expect_error(const std::string& arguments, int exit_code, const std::string& text) const {
    const Outcome result = run(arguments);
    EXPECT_EQ(result.exit_code, exit_code) << arguments << "\n" << result.err;
    EXPECT_NE((result.err + result.out).find(text), std::string::npos) << result.err << result.out;
  }
  bool exists(const std::string& name) const { return std::filesystem::exists(folder_.file(name)); }

  TempFolder folder_;
  std::string environment_ =
      "MAQ_BUNDLE='" MAQ_TEST_MODELS "/densepose-b-int8' MAQ_HEADS_BUNDLE='" MAQ_TEST_DATA "/round_heads/bundle'";
};

TEST_F(HeadCommandLine, APhotoBecomesAMeshAndAHead) {
  const Outcome result = run("grey.png --box 110,60,200,180 --out o/head.glb --save o/head.maqh --seconds 0 --cell 8");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(result.out.rfind("file:grey.png  head of 90 x 120 px  focal length ", 0), 0u) << result.out;
  for (const char* text : {"px (estimated)", "size the average of heads, +- 4.1 %; pupils ", "mm apart", "encode ",
                           "pose ", "o/head.glb: ", " triangles", "o/head.maqh"}) {
    EXPECT_NE(result.out.find(text), std::string::npos) << text << "\n" << result.out;
  }
  EXPECT_EQ(read_text(folder_.file("o/head.glb")).substr(0, 4), "glTF");

  const Outcome info = run("info o/head.maqh");
  ASSERT_EQ(info.exit_code, 0) << info.err;
  for (const char* text : {"photos     1", "the average of heads", "pupils     ", "nose_tip", "crown"}) {
    EXPECT_NE(info.out.find(text), std::string::npos) << text << "\n" << info.out;
  }
  const auto document = nlohmann::json::parse(run("info o/head.maqh --json").out);
  EXPECT_EQ(document["photos"], 1);
  EXPECT_EQ(document["scale"], "prior");
  EXPECT_EQ(document["landmarks"].size(), 5u);
  EXPECT_GT(document["landmarks"]["crown"]["point_m"][1], 0.08);
}

TEST_F(HeadCommandLine, ASavedHeadIsExportedAgainWithoutItsPhoto) {
  ASSERT_EQ(run("grey.png --box 110,60,200,180 --save head.maqh --seconds 0").exit_code, 0);
  const Outcome animatable = run("export head.maqh --out o/head.glb");
  ASSERT_EQ(animatable.exit_code, 0) << animatable.err;
  EXPECT_EQ(animatable.out, "o/head.glb: 363 vertices, 664 triangles, 2 morph targets\n");
  const std::string file = read_text(folder_.file("o/head.glb"));
  for (const char* text : {"jawOpen", "image/jpeg", "\"skins\"", "\"Head\""}) {
    EXPECT_NE(file.find(text), std::string::npos) << text;
  }
  const Outcome dense = run("export head.maqh --out o/head.ply --triangles 500 --cell 6");
  ASSERT_EQ(dense.exit_code, 0) << dense.err;
  EXPECT_NE(dense.out.find(" triangles, within "), std::string::npos) << dense.out;
  EXPECT_NE(run("head.maqh --out o/c.glb").exit_code, 0) << "it is no photo";
  expect_error("export head.maqh", 2, "--out is required");
  expect_error("export head.maqh --out a.stl", 2, "must end with .glb, .obj or .ply");
  expect_error("export head.maqh --out a.glb --triangles 5", 2, "neither 100 or more");
  expect_error("export none.maqh --out a.glb", 1, "none.maqh");
  expect_error("export grey.png --out a.glb", 1, "grey.png");
  expect_error("export head.maqh --out a.glb --bundle nowhere", 1, "nowhere");
  EXPECT_FALSE(exists("a.glb"));
}

TEST_F(HeadCommandLine, PhotosAreAddedToASavedHead) {
  const std::string made = "grey.png --box 110,60,200,180 --seconds 0 --save a.maqh ";
  ASSERT_EQ(run(made).exit_code, 0);
  const Outcome added = run(made + "--append a.maqh");
  ASSERT_EQ(added.exit_code, 0) << added.err;
  EXPECT_EQ(nlohmann::json::parse(run("info a.maqh --json").out)["photos"], 2);
  expect_error(made + "--append none.maqh", 1, "none.maqh");
  expect_error(made + "--append a.maqh --person all", 1, "--append takes the head of one person");
  EXPECT_EQ(nlohmann::json::parse(run("info a.maqh --json").out)["photos"], 2) << "what was there stays";
}

TEST_F(HeadCommandLine, FramesOfAClipArePhotosOfOneHead) {
  {
    cv::VideoWriter clip(folder_.file("turn.avi"), cv::VideoWriter::fourcc('M', 'J', 'P', 'G'), 10, cv::Size(320, 240));
    ASSERT_TRUE(clip.isOpened());
    for (int i = 0; i < 12; ++i) clip.write(cv::Mat(240, 320, CV_8UC3, cv::Scalar(120, 130, 140)));
  }
  const Outcome made = run("turn.avi --frames 3 --seconds 0 --json --save a.maqh");
  ASSERT_EQ(made.exit_code, 0) << made.err;
  const auto photos = nlohmann::json::parse(made.out)["photos"];
  ASSERT_EQ(photos.size(), 3u) << made.out;
  for (const size_t i : {0, 1, 2}) {
    EXPECT_EQ(photos[i]["photo"], "file:turn.avi, frame " + std::to_string(2 + 4 * i));
  }
  EXPECT_EQ(nlohmann::json::parse(run("info a.maqh --json").out)["photos"], 3);
  EXPECT_EQ(
      nlohmann::json::parse(run("turn.avi grey.png --frames 1 --seconds 0 --json --save b.maqh").out)["photos"].size(),
      2u);
  expect_error("turn.avi --person 2 --save c.maqh", 1, "not for a clip; see --frames");
  expect_error("turn.avi --frames 65 --save c.maqh", 2, "--frames");
  EXPECT_FALSE(exists("c.maqh"));
}

TEST_F(HeadCommandLine, ADistanceOrADepthImageGivesTheSize) {
  const std::string photo = "grey.png --box 110,60,200,180 --seconds 0 --json --save a.maqh ";
  const auto given = nlohmann::json::parse(run(photo + "--pupils 70").out);
  EXPECT_NEAR(given["pupil_distance_m"], 0.07, 1e-6);
  EXPECT_EQ(given["scale"], "given");
  EXPECT_EQ(nlohmann::json::parse(run("info a.maqh --json").out)["scale"], "given");

  double pupils_m[2];
  for (const int far : {1, 2}) {  // where a screen stands
    cv::imwrite(folder_.file("depth.png"), cv::Mat(240, 320, CV_16U, cv::Scalar(400 * far)));
    const auto measured = nlohmann::json::parse(run(photo + "--depth 'image:depth.png?depth_unit=0.001'").out);
    EXPECT_EQ(measured["scale"], "depth");
    pupils_m[far - 1] = measured["pupil_distance_m"];
  }
  EXPECT_NEAR(pupils_m[1] / pupils_m[0], 2, 1e-6) << "twice as far, twice as large";
  EXPECT_EQ(nlohmann::json::parse(run(photo).out)["scale"], "prior");

  expect_error(photo + "--depth photo", 1, "file:grey.png came without depth");
  expect_error(photo + "--depth grey.png", 1, "not depth");
  expect_error(photo + "--pupils 63 --depth photo", 2, "--pupils");
  expect_error(photo + "--pupils 5", 2, "10");
}

TEST_F(HeadCommandLine, AHeadIsRenderedAsPicturesAndClips) {
  const Outcome made = run("grey.png --box 110,60,200,180 --save head.maqh --preview p/turn.mp4 --seconds 0 --cell 8");
  ASSERT_EQ(made.exit_code, 0) << made.err;
  EXPECT_NE(made.out.find("p/turn.mp4: 150 frames, "), std::string::npos) << made.out;
  cv::VideoCapture preview(folder_.file("p/turn.mp4"));
  EXPECT_EQ(preview.get(cv::CAP_PROP_FRAME_WIDTH), 640);

  const Outcome front = run("render head.maqh --out v/front.png --size 160x120 --cell 6");
  ASSERT_EQ(front.exit_code, 0) << front.err;
  EXPECT_EQ(front.out, "v/front.png\n");
  const cv::Mat with_alpha = cv::imread(folder_.file("v/front.png"), cv::IMREAD_UNCHANGED);
  ASSERT_EQ(with_alpha.channels(), 4);
  ASSERT_EQ(with_alpha.size(), cv::Size(160, 120));
  EXPECT_EQ(with_alpha.at<cv::Vec4b>(2, 2)[3], 0);
  EXPECT_EQ(with_alpha.at<cv::Vec4b>(60, 80)[3], 255);

  std::vector<cv::Mat> images;
  for (const char* options : {"", "--shading shape", "--shading normals", "--shading template", "--shading depth",
                              "--yaw 90", "--pitch 60"}) {
    const Outcome ran = run(std::string("render head.maqh --out a.png --no-alpha --background 1,2,3 --size 80x60 ") +
                            "--cell 6 " + options);
    ASSERT_EQ(ran.exit_code, 0) << options << ran.err;
    images.push_back(cv::imread(folder_.file("a.png"), cv::IMREAD_UNCHANGED));
    EXPECT_EQ(images.back().at<cv::Vec3b>(0, 0), cv::Vec3b(3, 2, 1)) << options;
    for (size_t i = 0; i + 1 < images.size(); ++i) {
      EXPECT_GT(cv::norm(images[i], images.back(), cv::NORM_INF), 15) << options << " is as number " << i;
    }
  }
  EXPECT_NEAR(images[2].at<cv::Vec3b>(30, 40)[0], 250, 8) << "the face looks to the camera: blue";

  const Outcome photo = run("render head.maqh --out over.png --photo 1 --cell 6");
  ASSERT_EQ(photo.exit_code, 0) << photo.err;
  EXPECT_EQ(cv::imread(folder_.file("over.png")).size(), cv::Size(320, 240));

  const Outcome clip = run("render head.maqh --out c.mp4 --seconds 0.4 --fps 10 --size 64x48 --cell 6");
  ASSERT_EQ(clip.exit_code, 0) << clip.err;
  EXPECT_NE(clip.out.find("c.mp4: 4 frames, "), std::string::npos) << clip.out;
  cv::VideoCapture turn(folder_.file("c.mp4"));
  cv::Mat first, second;
  ASSERT_TRUE(turn.read(first) && turn.read(second));
  EXPECT_GT(cv::norm(first, second, cv::NORM_INF), 40) << "it turns";
}

TEST_F(HeadCommandLine, WrongViewsOfAHeadAreASentence) {
  ASSERT_EQ(run("grey.png --box 110,60,200,180 --save head.maqh --seconds 0").exit_code, 0);
  expect_error("render head.maqh", 2, "--out is required");
  expect_error("render --out a.png", 2, "head is required");
  expect_error("render head.maqh --out a.glb", 2, "must end with .png, .jpg or .mp4");
  expect_error("render head.maqh --out a.png --size big", 1, "--size big is not a size; write it as 640x480");
  expect_error("render head.maqh --out a.png --seconds 3", 1, "are for clips");
  expect_error("render head.maqh --out a.png --photo 2", 1, "so there is no photo 2");
  expect_error("render head.maqh --out a.mp4 --photo 1", 1, "--photo is one view");
  expect_error("render head.maqh --out a.png --photo 1 --yaw 3", 1, "--photo is one view");
  expect_error("render head.maqh --out a.png --background 1,2,300", 2, "--background");
  expect_error("render grey.png --out a.png", 1, "grey.png");
  expect_error("grey.png --preview turn.gif", 2, "must end with .png, .jpg or .mp4");
  EXPECT_FALSE(exists("a.png"));
}

TEST_F(HeadCommandLine, JsonSaysWhatWasFound) {
  const Outcome result =
      run("grey.png 'image:grey.png?fov=60' blue.png --out head.ply --seconds 0 --cell 8 --json --threads 1");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const auto document = nlohmann::json::parse(result.out);
  ASSERT_EQ(document["photos"].size(), 3u);
  EXPECT_EQ(document["photos"][0]["used"], true);
  EXPECT_EQ(document["photos"][0]["focal_known"], false);
  EXPECT_EQ(document["photos"][1]["focal_known"], true);
  EXPECT_NEAR(document["photos"][1]["focal_px"].get<double>(), 160 / std::tan(30 * 3.14159265358979 / 180), 0.01);
  EXPECT_EQ(document["photos"][2]["used"], false) << "another head";
  EXPECT_EQ(document["out"], "head.ply");
  EXPECT_GT(document["vertices"], 100);
  EXPECT_EQ(document["threads"], 1);
  for (const char* stage : {"find", "encode", "pose", "fit", "mesh"}) EXPECT_GE(document["ms"][stage], 0) << stage;
  const Outcome text = run("grey.png grey.png blue.png --out head.ply --seconds 0 --cell 8");
  EXPECT_NE(text.out.find("file:blue.png  head of "), std::string::npos) << text.out;
  EXPECT_NE(text.out.find("rejected: it shows no head, or a different person"), std::string::npos);
}

TEST_F(HeadCommandLine, PeopleAreFoundByDensePose) {
  const Outcome one = run("'" MAQ_TEST_MEDIA "/photo.jpg' --save a.maqh --seconds 0 --json");
  ASSERT_EQ(one.exit_code, 0) << one.err;
  const auto box = nlohmann::json::parse(one.out)["photos"][0]["box_px"];
  EXPECT_LT(box[2].get<double>() - box[0].get<double>(), 300) << "the head, not the photo";
  const Outcome all =
      run("'" MAQ_TEST_MEDIA "/photo.jpg' --save b/a.maqh --out b/a.obj --person all --seconds 0 --cell 8");
  ASSERT_EQ(all.exit_code, 0) << all.err;
  EXPECT_TRUE(exists("b/a_1.maqh"));
  EXPECT_TRUE(exists("b/a_1.obj"));
  EXPECT_TRUE(exists("b/a_1.mtl"));
  expect_error("'" MAQ_TEST_MEDIA "/photo.jpg' --out c.glb --person 99", 1, "heads, so there is no person 99");
}

TEST_F(HeadCommandLine, ErrorsSayWhatToDo) {
  expect_error("", 2, "photo is required");
  expect_error("grey.png", 2, "--out, --save or --preview is required");
  expect_error("grey.png --out head.stl", 2, "must end with .glb, .obj or .ply");
  expect_error("grey.png --out a.glb --seconds -1", 2, "--seconds");
  expect_error("grey.png --out a.glb --person nobody", 2, "neither 1 to 255 nor");
  expect_error("grey.png blue.png --out a.glb --person 2", 2, "are for a single photo");
  expect_error("none.png --out a.glb", 1, "none.png does not exist");
  expect_error("black.png --out a.glb --box 110,60,200,180", 1, "file:black.png: No head is seen in the box");
  expect_error("blue.png --out a.glb --seconds 0", 1, "does not show a head that can be fitted");
  expect_error("grey.png --out a.glb --bundle /nowhere", 1, "/nowhere");
  expect_error("grey.png --out a.glb --save a.glb", 1, "are the same file");
  expect_error("info grey.png", 1, "grey.png");
  EXPECT_FALSE(exists("a.glb"));
}

TEST_F(HeadCommandLine, HelpTeachesWithExamples) {
  const Outcome result = run("--help");
  EXPECT_EQ(result.exit_code, 0);
  for (const char* text : {"maquette head photo.jpg --out head.glb", "--person all", "--preview turn.mp4", "biometric",
                           "info", "maquette head render head.maqh"}) {
    EXPECT_NE(result.out.find(text), std::string::npos) << text;
  }
  const Outcome render = run("render --help");
  EXPECT_EQ(render.exit_code, 0);
  for (const char* text : {"--shading normals --seconds 4", "--photo 1", "near is white"}) {
    EXPECT_NE(render.out.find(text), std::string::npos) << text;
  }
}

}  // namespace
