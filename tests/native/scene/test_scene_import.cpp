// Captures from disk: COLMAP models and transforms.json, with their photos and clouds.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "scene/capture/capture.h"
#include "support/capture_files.h"
#include "support/expect_error.h"

namespace {

using maq::Capture;
using maq::CaptureView;
using maq::Distortion;
using nlohmann::json;

std::string texts_of(const std::vector<maq::Dropped>& dropped) {
  std::string text;
  for (const maq::Dropped& one : dropped) text += maq::describe(one) + "\n";
  return text;
}

// A camera of each model that is read.
MadeCapture of_every_model() {
  MadeCapture made;
  made.cameras = {
      {1, "SIMPLE_PINHOLE", 0, 32, 24, {30.5, 16.1, 12.2}},
      {2, "PINHOLE", 1, 32, 24, {30.5, 31.25, 16.1, 12.2}},
      {3, "SIMPLE_RADIAL", 2, 32, 24, {30.5, 16.1, 12.2, -0.11}},
      {4, "RADIAL", 3, 32, 24, {30.5, 16.1, 12.2, -0.11, 0.021}},
      {5, "OPENCV", 4, 32, 24, {30.5, 31.25, 16.1, 12.2, -0.11, 0.021, 0.001, -0.002}},
      {6, "OPENCV_FISHEYE", 5, 32, 24, {30.5, 31.25, 16.1, 12.2, 0.03, -0.011, 0.004, -0.0009}},
      {7, "FULL_OPENCV", 6, 32, 24, {30.5, 31.25, 16.1, 12.2, -.21, .07, .0013, -.0021, .011, .05, -.02, .004}}};
  made.images.clear();
  for (const MadeCamera& camera : made.cameras) {
    const double a = 0.1 * camera.id;
    made.images.push_back({camera.id + 10,
                           {std::cos(a), 0, std::sin(a), 0, a, 1.0 / 3, -2 * a},
                           camera.id,
                           "cam/" + camera.model + ".png"});
  }
  return made;
}

class SceneImport : public ::testing::Test {
 protected:
  Capture open() const { return maq::open_capture(folder_.path().string()); }
  Capture open_colmap(const MadeCapture& made, bool is_text = false) const {
    made.write_photos(folder_);
    made.write_colmap(folder_, is_text);
    return open();
  }
  void write_transforms(const json& document) const { write_text(folder_.file("transforms.json"), document.dump()); }
  // A frame of a camera that looks along the world's y, with z up, from `x`.
  static json frame(const std::string& name, double x = 0) {
    return {{"file_path", name}, {"transform_matrix", {{1, 0, 0, x}, {0, 0, -1, 0}, {0, 1, 0, 0}, {0, 0, 0, 1}}}};
  }
  json transforms() const {
    MadeCapture made;
    made.write_photos(folder_);
    write_text(folder_.file("points.ply"), made.ply_text());
    return {{"fl_x", 30},
            {"fl_y", 31},
            {"cx", 16.5},
            {"cy", 12},
            {"w", 32},
            {"h", 24},
            {"ply_file_path", "points.ply"},
            {"frames", {frame("images/a.png", -1), frame("./images/b.png", 0), frame("images/c.png", 1)}}};
  }
  void expect_refused(maq_status status, const std::string& part) const {
    expect_error(status, part, [&] { open(); });
  }

  const TempFolder folder_;
};

TEST_F(SceneImport, TextAndBinaryOfTheSameModelAgree) {
  const MadeCapture made = of_every_model();
  const Capture binary = open_colmap(made);
  std::filesystem::remove_all(folder_.path() / "sparse");
  const Capture text = open_colmap(made, /*is_text=*/true);
  ASSERT_EQ(binary.views.size(), made.cameras.size());
  ASSERT_EQ(text.views.size(), made.cameras.size());
  for (size_t i = 0; i < text.views.size(); ++i) {
    const CaptureView &a = text.views[i], &b = binary.views[i];
    EXPECT_EQ(a.name, b.name);
    EXPECT_TRUE(a.lens == b.lens) << a.name;
    EXPECT_NEAR(a.camera.fx_px, b.camera.fx_px, 1e-12);
    EXPECT_NEAR(a.camera.fy_px, b.camera.fy_px, 1e-12);
    for (size_t k = 0; k < 9; ++k) EXPECT_NEAR(a.camera.rotation[k], b.camera.rotation[k], 1e-12);
    for (size_t k = 0; k < 3; ++k) EXPECT_NEAR(a.camera.centre[k], b.camera.centre[k], 1e-12);
  }
  EXPECT_EQ(text.cloud.origin, binary.cloud.origin);
  EXPECT_EQ(text.cloud.x, binary.cloud.x);
  EXPECT_EQ(text.cloud.y, binary.cloud.y);
  EXPECT_EQ(text.cloud.z, binary.cloud.z);
  EXPECT_EQ(text.cloud.rgb, binary.cloud.rgb);
  EXPECT_EQ(text.up, binary.up);
  EXPECT_EQ(texts_of(text.dropped), "");
  EXPECT_EQ(texts_of(binary.dropped), "");
}

TEST_F(SceneImport, CamerasOfColmapAreThoseOfOpenCvHalfAPixelOff) {
  const Capture capture = open_colmap(of_every_model());
  const std::vector<std::array<double, 8>> coefficients = {{},
                                                           {},
                                                           {-0.11},
                                                           {-0.11, 0.021},
                                                           {-0.11, 0.021, 0.001, -0.002},
                                                           {0.03, -0.011, 0.004, -0.0009},
                                                           {-.21, .07, .0013, -.0021, .011, .05, -.02, .004}};
  for (size_t i = 0; i < 7; ++i) {
    const maq::Lens& lens = capture.views[i].lens;
    EXPECT_EQ(lens.fx_px, 30.5);
    EXPECT_EQ(lens.fy_px, i == 0 || i == 2 || i == 3 ? 30.5 : 31.25) << i;
    EXPECT_NEAR(lens.cx_px, 15.6, 1e-12);
    EXPECT_NEAR(lens.cy_px, 11.7, 1e-12);
    EXPECT_EQ(lens.coefficients, coefficients[i]) << i;
    EXPECT_EQ(lens.distortion, i < 2 ? Distortion::kNone : i == 5 ? Distortion::kFisheye : Distortion::kRational) << i;
    EXPECT_EQ(capture.views[i].camera.width_px, 32);
    EXPECT_EQ(capture.views[i].camera.height_px, 24);
    maq::check_camera(capture.views[i].camera, "The view");
  }
}

// x' = R x + t, R of the quaternion, as COLMAP's documentation has it; the quaternion rotated here by hand.
TEST_F(SceneImport, PosesOfColmapAreWorldToCamera) {
  const MadeCapture made = of_every_model();
  const Capture capture = open_colmap(made);
  const double x[3] = {0.3, -0.7, 5};
  for (size_t i = 0; i < capture.views.size(); ++i) {
    const auto& camera = capture.views[i].camera;
    const double angle = 0.1 * made.cameras[i].id * 2;  // about y
    const double expected[3] = {std::cos(angle) * x[0] + std::sin(angle) * x[2] + made.images[i].pose[4],
                                x[1] + made.images[i].pose[5],
                                -std::sin(angle) * x[0] + std::cos(angle) * x[2] + made.images[i].pose[6]};
    for (size_t k = 0; k < 3; ++k) {
      double seen = 0;
      for (size_t j = 0; j < 3; ++j) seen += camera.rotation[3 * k + j] * (x[j] - camera.centre[j]);
      EXPECT_NEAR(seen, expected[k], 1e-12) << i;
    }
  }
}

TEST_F(SceneImport, ModelsAreFoundInEachOfTheirPlaces) {
  for (const char* place : {"sparse/0", "sparse", "colmap/sparse/0", "."}) {
    for (const char* photos : {"images", "photos", "rgb", "input", "."}) {
      const TempFolder folder;
      MadeCapture made;
      made.write_photos(folder, photos);
      made.write_colmap(folder, place[0] == 's', place);
      EXPECT_EQ(maq::open_capture(folder.path().string()).views.size(), 3u) << place << ", " << photos;
    }
  }
}

TEST_F(SceneImport, ADenseCloudTakesThePlaceOfTheModelsPoints) {
  MadeCapture dense;
  dense.points.resize(2);
  write_text(folder_.file("fused.ply"), dense.ply_binary(false));
  EXPECT_EQ(open_colmap(MadeCapture()).cloud.count(), 2u);
}

TEST_F(SceneImport, UpIsWhereTheCamerasHaveIt) {
  MadeCapture made;
  // Turned by 30 degrees up and down about their own x axis: the mean is -y of the world.
  const double a = 15 * 3.14159265358979323846 / 180;
  made.images = {{1, {std::cos(a), std::sin(a), 0, 0, 0, 0, 0}, 7, "a.png"},
                 {2, {std::cos(a), -std::sin(a), 0, 0, 0, 0, 0}, 7, "b.png"}};
  Capture capture = open_colmap(made);
  EXPECT_NEAR(capture.up[0], 0, 1e-12);
  EXPECT_NEAR(capture.up[1], -1, 1e-12);
  EXPECT_NEAR(capture.up[2], 0, 1e-12);
  // One the right way up and one upside down: that of the first.
  made.images = {{1, {0, 0, 0, 1, 0, 0, 0}, 7, "a.png"}, {2, {1, 0, 0, 0, 0, 0, 0}, 7, "b.png"}};
  capture = open_colmap(made);
  EXPECT_NEAR(capture.up[1], 1, 1e-12);
}

TEST_F(SceneImport, TransformsAreCamerasInAxesOfOpenGl) {
  write_transforms(transforms());
  const Capture capture = open();
  ASSERT_EQ(capture.views.size(), 3u);
  EXPECT_EQ(texts_of(capture.dropped), "");
  const maq::PinholeCamera& camera = capture.views[2].camera;
  EXPECT_EQ(camera.centre, (std::array<double, 3>{1, 0, 0}));
  // A point to the right (x), in front (y) and above (z) in the world, as the camera sees it: right, up, forward.
  const double d[3] = {0.5, 4, 1};
  double seen[3] = {};
  for (size_t k = 0; k < 9; ++k) seen[k / 3] += camera.rotation[k] * d[k % 3];
  EXPECT_NEAR(seen[0], 0.5, 1e-12);
  EXPECT_NEAR(seen[1], -1, 1e-12);
  EXPECT_NEAR(seen[2], 4, 1e-12);
  EXPECT_EQ(camera.fx_px, 30);
  EXPECT_EQ(camera.fy_px, 31);
  EXPECT_EQ(camera.cx_px, 16);
  EXPECT_EQ(camera.cy_px, 11.5);
  EXPECT_EQ(capture.up, (std::array<double, 3>{0, 0, 1}));
  EXPECT_EQ(capture.cloud.count(), 4u);
}

TEST_F(SceneImport, TransformsWhoseCamerasLieOnTheirSideHaveTheirUp) {
  json document = transforms();
  for (json& frame : document["frames"]) frame["transform_matrix"] = {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}};
  write_transforms(document);
  EXPECT_EQ(open().up, (std::array<double, 3>{0, 1, 0}));
}

TEST_F(SceneImport, FramesMayHaveIntrinsicsOfTheirOwn) {
  json document = transforms();
  document["k1"] = 0.01;
  document["p2"] = 0.002;
  document["k3"] = -0.003;
  document["frames"][1].update({{"fl_x", 40}, {"k1", 0}, {"p2", 0}, {"k3", 0.0}});
  document["frames"][2].update({{"camera_model", "OPENCV_FISHEYE"}, {"k4", 0.0001}});
  write_transforms(document);
  const Capture capture = open();
  ASSERT_EQ(capture.views.size(), 3u);
  EXPECT_EQ(capture.views[0].lens.distortion, Distortion::kRational);
  EXPECT_EQ(capture.views[0].lens.coefficients, (std::array<double, 8>{0.01, 0, 0, 0.002, -0.003}));
  EXPECT_EQ(capture.views[1].lens.fx_px, 40);
  EXPECT_EQ(capture.views[1].lens.distortion, Distortion::kNone);
  EXPECT_EQ(capture.views[2].lens.distortion, Distortion::kFisheye);
  EXPECT_EQ(capture.views[2].lens.coefficients, (std::array<double, 8>{0.01, 0, -0.003, 0.0001}));
}

TEST_F(SceneImport, AnAngleOfViewAndThePhotosSizeAreEnough) {
  json document = transforms();
  for (const char* key : {"fl_x", "fl_y", "cx", "cy", "w", "h", "ply_file_path"}) document.erase(key);
  document["camera_angle_x"] = 2 * std::atan(0.5);
  document["frames"] = {frame("images/a")};
  std::filesystem::rename(folder_.path() / "points.ply", folder_.path() / "points3d.ply");
  write_text(folder_.file("transforms_train.json"), document.dump());
  const Capture capture = open();
  ASSERT_EQ(capture.views.size(), 1u);
  EXPECT_EQ(capture.views[0].name, "images/a.png");
  EXPECT_NEAR(capture.views[0].camera.fx_px, 32, 1e-12);
  EXPECT_NEAR(capture.views[0].camera.fy_px, 32, 1e-12);
  EXPECT_EQ(capture.views[0].camera.cx_px, 15.5);
  EXPECT_EQ(capture.views[0].camera.cy_px, 11.5);
}

TEST_F(SceneImport, APhotoOfAnotherSizeStandsForItsCameraWhenItHasItsShape) {
  MadeCapture made;
  made.write_colmap(folder_, false);
  made.write_photos(folder_, "images", 64, 48);
  cv::imwrite(folder_.file("images/b.png"), cv::Mat(24, 30, CV_8UC3, cv::Scalar()));
  const Capture capture = open();
  ASSERT_EQ(capture.views.size(), 2u);
  EXPECT_EQ(capture.views[0].camera.width_px, 64);
  EXPECT_EQ(capture.views[0].camera.fx_px, 60);
  EXPECT_EQ(capture.views[0].camera.fy_px, 62);
  EXPECT_EQ(capture.views[0].camera.cx_px, 32);  // 16.25 from the edge, twice, half a pixel off
  EXPECT_EQ(texts_of(capture.dropped), "1 photos of another shape than their camera (first: b.png)\n");
}

TEST_F(SceneImport, WhatCannotBeUsedIsDroppedAndCountedWithItsReason) {
  const double nan = std::nan("");
  MadeCapture made;
  made.cameras.push_back({8, "PINHOLE", 1, 32, 24, {30, 0, 16, 12}});
  made.cameras.push_back({9, "PINHOLE", 1, 32, 24, {-30, 30, 16, 12}});
  made.cameras.push_back({10, "PINHOLE", 1, 32, 24, {30, 30, nan, 12}});
  made.cameras.push_back({11, "PINHOLE", 1, 0, 24, {30, 30, 16, 12}});
  made.cameras.push_back({12, "PINHOLE", 1, uint64_t(1) << 32, 24, {30, 30, 16, 12}});
  made.cameras.push_back({13, "SIMPLE_RADIAL", 2, 32, 24, {30, 16, 12, -1e9}});
  made.cameras.push_back({14, "PINHOLE", 1, 32, 24, {30, 30, 16, 12}});
  made.cameras.push_back({7, "PINHOLE", 1, 32, 24, {99, 99, 16, 12}});
  const std::vector<double> pose = {1, 0, 0, 0, 0, 0, 0};
  for (uint32_t id = 8; id <= 13; ++id)
    made.images.push_back({id + 100, pose, id, "camera" + std::to_string(id) + ".png"});
  made.images.push_back({1, pose, 7, "again.png"});
  made.images.push_back({200, pose, 7, "a.png"});
  made.images.push_back({201, pose, 99, "orphan.png"});
  made.images.push_back({202, {0, 0, 0, 0, 0, 0, 0}, 7, "zero.png"});
  made.images.push_back({203, {2, 0, 0, 0, 0, 0, 0}, 7, "long.png"});
  made.images.push_back({204, {1, 0, 0, 0, nan, 0, 0}, 7, "nan.png"});
  made.images.push_back({205, {1, 0, nan, 0, 0, 0, 0}, 7, "nan2.png"});
  made.images.push_back({206, {1, 0, 0, 0, 1e200, 0, 0}, 7, "far.png"});
  made.write_photos(folder_);
  made.images.push_back({207, pose, 7, "missing.png"});
  made.images.push_back({208, pose, 7, "../up.png"});
  made.images.push_back({209, pose, 7, "/etc/passwd"});
  made.images.push_back({210, pose, 7, "x/../../up.png"});
  made.images.push_back({211, pose, 7, "text.png"});
  made.images.push_back({212, pose, 7, "folder"});
  made.images.push_back({213, pose, 7, "huge.png"});
  made.images.push_back({214, pose, 7, "a.gif"});
  cv::imwrite(folder_.path().parent_path() / "up.png", cv::Mat(24, 32, CV_8UC3, cv::Scalar()));
  write_text(folder_.file("images/text.png"), "no image");
  write_text(folder_.file("images/a.gif"), "GIF89a" + std::string(100, 1));
  std::filesystem::create_directories(folder_.path() / "images" / "folder");
  std::string huge = read_text(folder_.file("images/a.png"));
  huge[17] = 1;  // 65568 pixels wide
  write_text(folder_.file("images/huge.png"), huge);
  made.points.push_back({nan, 0, 0, 1, 1, 1});
  made.points.push_back({0, 1e40, 0, 1, 1, 1});
  for (const bool is_text : {false, true}) {
    std::filesystem::remove_all(folder_.path() / "sparse");
    made.write_colmap(folder_, is_text);
    const Capture capture = open();
    EXPECT_EQ(capture.views.size(), 3u);
    EXPECT_EQ(capture.views[0].lens.fx_px, 30) << "the first camera of a number stays";
    EXPECT_EQ(capture.cloud.count(), 4u);
    EXPECT_EQ(texts_of(capture.dropped),
              "1 cameras whose number was there before (first: 7)\n"
              "1 photos whose number was there before (first: again.png)\n"
              "1 photos without a camera (first: orphan.png)\n"
              "1 cameras without a photo (first: 14)\n"
              "2 photos whose camera has no positive focal length (first: camera8.png)\n"
              "1 photos whose camera has numbers that are not finite (first: camera10.png)\n"
              "2 photos whose camera has no size, or one over the limit (first: camera11.png)\n"
              "1 photos whose distortion is not invertible, or whose axis is outside of them (first: camera13.png)\n"
              "1 photos that are named twice (first: a.png)\n"
              "2 photos whose rotation is not of length 1, or mirrors (first: zero.png)\n"
              "3 photos whose pose is not finite (first: nan.png)\n"
              "1 photos that are not in their folder (first: missing.png)\n"
              "3 photos whose name leads out of their folder (first: ../up.png)\n"
              "3 photos that cannot be read as images (first: text.png)\n"
              "1 photos without pixels, or over the limit of size (first: huge.png)\n"
              "2 points whose position is not finite\n");
  }
  std::filesystem::remove(folder_.path().parent_path() / "up.png");
}

TEST_F(SceneImport, FramesThatCannotBeUsedAreDroppedAndCounted) {
  json document = transforms();
  json mirrored = frame("images/b.png"), scaled = frame("images/b.png"), zero = frame("images/c.png");
  mirrored["transform_matrix"][0][0] = -1;
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k)
      scaled["transform_matrix"][i][k] = 2 * frame("")["transform_matrix"][i][k].get<double>();
  }
  scaled["file_path"] = "images/c.png";
  zero["fl_x"] = 0;
  zero["file_path"] = "images/d.png";
  document["frames"] = {frame("images/a.png"), mirrored, scaled, zero, frame("../a.png"), frame("images/none.png")};
  write_transforms(document);
  EXPECT_EQ(texts_of(open().dropped),
            "1 photos whose name leads out of their folder (first: ../a.png)\n"
            "2 photos whose rotation is not of length 1, or mirrors (first: images/b.png)\n"
            "1 photos whose camera has no positive focal length (first: images/d.png)\n"
            "1 photos that are not in their folder (first: images/none.png)\n");
}

TEST_F(SceneImport, FoldersWithoutACaptureAreASentence) {
  expect_error(MAQ_ERROR_NOT_FOUND, "is not a folder", [&] { maq::open_capture(folder_.file("nowhere")); });
  expect_refused(MAQ_ERROR_NOT_FOUND, "holds no capture");
  expect_refused(MAQ_ERROR_NOT_FOUND, "python -m maquette scene make " + folder_.path().string() + " --out place.maqs");
  write_text(folder_.file("film.mp4"), "film");
  expect_error(MAQ_ERROR_NOT_FOUND, "film.mp4 is a file, not a folder with photos and cameras. To find the cameras",
               [&] { maq::open_capture(folder_.file("film.mp4")); });
  MadeCapture made;
  made.write_colmap(folder_, false);
  expect_refused(MAQ_ERROR_UNREADABLE,
                 "no photo that can be used: 3 photos that are not in their folder (first: a.png)");
  made.write_photos(folder_);
  made.points.clear();
  made.write_colmap(folder_, false);
  expect_refused(MAQ_ERROR_UNREADABLE, "without a point that can be used.");
  made.points = {{std::nan(""), 0, 0, 0, 0, 0}};
  made.write_colmap(folder_, false);
  expect_refused(MAQ_ERROR_UNREADABLE, "used: 1 points whose position is not finite.");
  made.images.clear();
  made.write_colmap(folder_, false);
  expect_refused(MAQ_ERROR_UNREADABLE, "no photo that can be used: 1 cameras without a photo (first: 7)");
}

// A reader that opened one would wait indefinitely.
TEST_F(SceneImport, PipesInPlaceOfFilesAreRefused) {
  open_colmap(MadeCapture());
  std::filesystem::remove(folder_.path() / "images" / "a.png");
  ASSERT_EQ(mkfifo(folder_.file("images/a.png").c_str(), 0600), 0);
  EXPECT_EQ(texts_of(open().dropped), "1 photos that cannot be read as images (first: a.png)\n");
  std::filesystem::remove(folder_.path() / "sparse" / "0" / "points3D.bin");
  ASSERT_EQ(mkfifo(folder_.file("sparse/0/points3D.bin").c_str(), 0600), 0);
  expect_refused(MAQ_ERROR_UNREADABLE, "is not a file");
}

TEST_F(SceneImport, OtherCameraModelsAreASentence) {
  MadeCapture made;
  made.cameras[0] = {7, "FOV", 7, 32, 24, {30, 30, 16, 12, 0.5}};
  made.write_photos(folder_);
  made.write_colmap(folder_, true);
  expect_refused(MAQ_ERROR_UNSUPPORTED, "a camera of the model FOV; the models that are read are SIMPLE_PINHOLE");
  made.write_colmap(folder_, false);
  expect_refused(MAQ_ERROR_UNSUPPORTED, "a camera of model number 7; the models");
}

TEST_F(SceneImport, TransformsThatSayNothingOfUseAreASentence) {
  const json whole = transforms();
  const auto expect = [&](const std::string& text, const std::string& part, maq_status status = MAQ_ERROR_UNREADABLE) {
    write_text(folder_.file("transforms.json"), text);
    expect_refused(status, part);
  };
  const auto with = [&](const char* key, const json& value) {
    json document = whole;
    document[key] = value;
    return document.dump();
  };
  const auto with_frame = [&](const char* key, const json& value) {
    json document = whole;
    document["frames"][1][key] = value;
    return document.dump();
  };
  expect("", "is not a JSON object");
  expect("[]", "is not a JSON object");
  expect("{\"frames\": [NaN]}", "is not a JSON object");
  expect("{}", "no list \"frames\"");
  expect(with("frames", 3), "no list \"frames\"");
  expect(with("frames", {3}), "frame 0: it is not a JSON object");
  expect(with("frames", json::array()), "no photo that can be used: there are none");
  expect(with("fl_x", "thirty"), "\"fl_x\" is not a number");
  expect(with("fl_x", nullptr), "\"fl_x\" is not a number");
  expect(with_frame("file_path", 3), "frame 1: \"file_path\" is not a text");
  expect(with_frame("file_path", ""), "frame 1: \"file_path\" is missing");
  expect(with_frame("transform_matrix", {1, 2}), "frame 1: \"transform_matrix\" is not one of");
  expect(with_frame("transform_matrix", {{1, 2}, {3}, 4, {}}), "frame 1: \"transform_matrix\" is not one of");
  expect(with_frame("is_fisheye", 1), "\"is_fisheye\" is neither true nor false");
  expect(with("camera_model", "EQUIRECTANGULAR"), "\"camera_model\" EQUIRECTANGULAR", MAQ_ERROR_UNSUPPORTED);
  expect(with("k4", 0.1), "\"k4\" 0.1", MAQ_ERROR_UNSUPPORTED);
  expect(with("ply_file_path", "../points.ply"), "leads out of its folder");
  expect(with("ply_file_path", "none.ply"), "none.ply does not exist", MAQ_ERROR_NOT_FOUND);
  json document = whole;
  document.erase("ply_file_path");
  expect(document.dump(), "names no point cloud", MAQ_ERROR_NOT_FOUND);
  document = whole;
  document.erase("fl_x");
  document.erase("fl_y");
  expect(document.dump(), "neither \"fl_x\" nor \"camera_angle_x\"");
  expect(std::string(20 << 20, '['), "over the limit");
  expect(std::string(1 << 20, '['), "is not a JSON object");
}

TEST_F(SceneImport, PhotosAreTakenAsTheyAreStoredNotRotatedByExif) {
  MadeCapture made;
  for (MadeImage& image : made.images) image.name[1] = '.', image.name.replace(2, 3, "jpg");
  made.write_photos(folder_);
  made.write_colmap(folder_, false);
  std::string jpeg = read_text(folder_.file("images/a.jpg"));
  // An APP1 segment that says only: turn by 90 degrees.
  std::string exif(
      "\xff\xe1\x00\x22"
      "Exif\0\0"
      "MM\0*\0\0\0\x08"
      "\0\x01"
      "\x01\x12\0\x03\0\0\0\x01\0\x06\0\0"
      "\0\0\0\0",
      36);
  jpeg.insert(2, exif);
  write_text(folder_.file("images/a.jpg"), jpeg);
  cv::Mat upright = cv::imread(folder_.file("images/a.jpg"));
  ASSERT_EQ(upright.cols, 24) << "the photo's orientation must be understood by others";
  const Capture capture = open();
  ASSERT_EQ(capture.views.size(), 3u);
  maq::Frame picture;
  std::vector<uint8_t> valid;
  maq::load_view(capture.views[0], picture, valid);
  EXPECT_EQ(picture.image.width_px, 32);
  EXPECT_EQ(picture.image.height_px, 24);
}

// An image that encodes the coordinates of each pixel, seen by a distorted camera, tells after loading where each came
// from.
TEST_F(SceneImport, ViewsAreLoadedUndistorted) {
  MadeCapture made = of_every_model();
  const Capture capture = open_colmap(made);
  for (const CaptureView& view : capture.views) {
    cv::Mat image(24, 32, CV_8UC3);
    for (int y = 0; y < 24; ++y) {
      for (int x = 0; x < 32; ++x) image.at<cv::Vec3b>(y, x) = cv::Vec3b(uint8_t(7 * x), uint8_t(10 * y), 50);
    }
    cv::imwrite(view.image_path, image);
    maq::Frame picture;
    std::vector<uint8_t> valid;
    maq::load_view(view, picture, valid);
    ASSERT_EQ(picture.image.width_px, view.camera.width_px);
    ASSERT_EQ(valid, std::vector<uint8_t>(32 * 24, 255)) << view.name;
    for (const auto& [x, y] : {std::pair{3, 4}, {16, 12}, {28, 20}, {30, 2}}) {
      const auto at = maq::LensProjection(view.lens).find((x - view.camera.cx_px) / view.camera.fx_px,
                                                          (y - view.camera.cy_px) / view.camera.fy_px);
      const uint8_t* pixel = picture.storage.data() + 3 * (y * 32 + x);
      EXPECT_NEAR(pixel[0], 7 * at->column_px, 1) << view.name;
      EXPECT_NEAR(pixel[1], 10 * at->row_px, 1) << view.name;
    }
  }
}

TEST_F(SceneImport, TheCloudsOriginIsAmidTheCamerasSoThatPositionsFarAwayAreExact) {
  MadeCapture made;
  made.images.resize(2);
  for (MadeImage& image : made.images) image.pose = {1, 0, 0, 0, -1e7, 2e7, 0};
  made.points = {{1e7 + 0.125, -2e7 - 0.0625, 4.0009765625, 1, 2, 3}};
  const Capture capture = open_colmap(made);
  EXPECT_EQ(capture.cloud.origin, (std::array<double, 3>{1e7, -2e7, 0}));
  EXPECT_EQ(capture.cloud.x[0], 0.125f);
  EXPECT_EQ(capture.cloud.y[0], -0.0625f);
  EXPECT_EQ(capture.cloud.z[0], 4.0009765625f);
}

}  // namespace
