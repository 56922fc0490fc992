// The whole chain on the tiny bundle, whose answers are known (make_tiny_bundle.py says what it sees).
#include <gtest/gtest.h>

#include <cstring>
#include <opencv2/core.hpp>

#include "densepose/densepose.h"
#include "nn/sha256.h"
#include "support/expect_error.h"
#include "support/samples/bundle_copy.h"
#include "support/samples/tiny_people.h"

namespace {

class DensePose : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    runtime_ = std::make_shared<maq::OnnxRuntimeLibrary>(MAQ_TEST_ONNXRUNTIME, maq::Log());
  }
  static void TearDownTestSuite() { runtime_.reset(); }

  static maq::DensePose make(maq::DensePoseSettings settings,
                             const std::string& bundle = std::string(MAQ_TEST_DATA) + "/tiny_bundle") {
    return {runtime_, maq::read_bundle(bundle), settings};
  }

  maq::DensePoseResult run(const cv::Mat& bgr, maq::DensePoseSettings settings = {}) {
    maq::DensePoseResult result;
    make(settings).run({MAQ_PIXEL_BGR8, bgr.cols, bgr.rows, {{bgr.data, bgr.step}, {}}}, result);
    return result;
  }

  // Whatever comes out, it must be inside the frame, finite and consistent.
  static void expect_sane(const maq::DensePoseResult& result, int width, int height) {
    ASSERT_EQ(result.planes.part.size(), size_t(width) * size_t(height));
    for (const maq::Person& person : result.people) {
      EXPECT_TRUE(person.box.x0 >= 0 && person.box.y0 >= 0 && person.box.x1 <= float(width) &&
                  person.box.y1 <= float(height));
      EXPECT_TRUE(person.score >= 0 && person.score <= 1);
    }
    int64_t body = 0;
    for (size_t i = 0; i < result.planes.part.size(); ++i) {
      ASSERT_LE(result.planes.part[i], 24);
      ASSERT_LE(result.planes.person[i], result.people.size());
      ASSERT_EQ(result.planes.part[i] == 0, result.planes.person[i] == 0);
      body += result.planes.part[i] != 0;
    }
    EXPECT_EQ(body, result.stats.decoded.body_pixels);
  }

  static std::shared_ptr<const maq::OnnxRuntimeLibrary> runtime_;
};

std::shared_ptr<const maq::OnnxRuntimeLibrary> DensePose::runtime_;

TEST_F(DensePose, AManifestThatDoesNotFitItsGraphsIsRefusedWhenTheyAreLoaded) {
  const auto expect_refused = [](const char* key, const nlohmann::json& value, const std::string& text) {
    const BundleCopy bundle;
    nlohmann::json manifest = bundle.manifest();
    manifest[nlohmann::json::json_pointer(key)] = value;
    bundle.write_manifest(manifest);
    expect_error(MAQ_ERROR_BAD_BUNDLE, text, [&] { make({}, bundle.path()); });
  };
  expect_refused("/box_head/pool_size", 9, "graph box_head: input rois must have the shape [n, 9, 9, 3]");
  expect_refused("/dense_head/coarse_classes", 14,
                 "graph dense_head: output labels must have the shape [n, 32, 32, 156]");
  // Names for sizes leave it to the graph.
  const BundleCopy bundle;
  nlohmann::json manifest = bundle.manifest();
  for (const int pool_size : {9, 7}) {
    manifest["box_head"]["pool_size"] = pool_size;
    manifest["graphs"]["box_head"]["inputs"][0]["shape"] = {"n", "pool", "pool", "channels"};
    bundle.write_manifest(manifest);
    if (pool_size == 7) {
      EXPECT_NO_THROW(make({}, bundle.path()));
    } else {
      expect_error(MAQ_ERROR_BAD_BUNDLE, "has shape [?, 7, 7, 3] in the graph", [&] { make({}, bundle.path()); });
    }
  }
}

TEST_F(DensePose, OneCellOfColourIsOnePersonInItsAnchor) {
  cv::Mat image = black(320, 256);
  image(cv::Rect(80, 100, 4, 4)) = kRed;     // cell (20, 25) of P2
  image(cv::Rect(200, 128, 8, 8)) = kGreen;  // cell (25, 16) of P3
  const maq::DensePoseResult result = run(image);
  ASSERT_EQ(result.people.size(), 2u);
  const maq::Box& red = result.people[0].box;
  const maq::Box& green = result.people[1].box;
  EXPECT_NEAR(red.x0, 80 - 16 + 3.2, 1e-3);
  EXPECT_NEAR(red.y0, 100 - 16, 1e-3);
  EXPECT_NEAR(red.x1, 80 + 16 + 3.2, 1e-3);
  EXPECT_NEAR(red.y1, 100 + 16, 1e-3);
  EXPECT_NEAR(green.x0, 200 - 32 + 6.4, 1e-3);
  EXPECT_NEAR(green.y1, 128 + 32, 1e-3);
  EXPECT_GT(result.people[0].score, 0.9);
  expect_sane(result, 320, 256);
}

TEST_F(DensePose, ThePlanesOfAPersonAreTheDenseHeadsAnswer) {
  cv::Mat image = black(320, 256);
  image(cv::Rect(160, 96, 16, 16)) = kBlue;  // cell (10, 6) of P4: a person of 128 px
  const maq::DensePoseResult result = run(image);
  ASSERT_EQ(result.people.size(), 1u);
  const maq::Box box = result.people[0].box;
  ASSERT_NEAR(box.width(), 128, 1);
  // The dense head sees more than the box: 3 % of the width and 5 % of the height on each side.
  const float beside = 0.03f * box.width(), above = 0.05f * box.height();
  const maq::PixelRect rect = maq::pixel_rect({box.x0 - beside, box.y0 - above, box.x1 + beside, box.y1 + above});
  int64_t body = 0, clamped = 0;
  for (int y = 0; y < 256; ++y) {
    for (int x = 0; x < 320; ++x) {
      const size_t pixel = size_t(y * 320 + x);
      const auto cell = [](int at, int extent) { return std::clamp((at + 0.5) * 64 / extent - 0.5, 0.0, 63.0); };
      const double col = cell(x - rect.x, rect.width), row = cell(y - rect.y, rect.height);
      const bool in_box = x >= rect.x && y >= rect.y && x < rect.x + rect.width && y < rect.y + rect.height;
      const bool is_body = in_box && row > 15.5;
      ASSERT_EQ(result.planes.person[pixel], is_body ? 1 : 0) << x << " " << y;
      if (!is_body) continue;
      const double u = 0.5 + 0.61 * (2 * col / 63 - 1), v = 0.5 + 0.5 * (2 * row / 63 - 1);
      ASSERT_EQ(result.planes.part[pixel], col <= 31.5 ? 3 : 7) << x;
      ASSERT_NEAR(result.planes.u[pixel], 255 * std::clamp(u, 0.0, 1.0), 0.51);
      ASSERT_NEAR(result.planes.v[pixel], 255 * v, 0.51);
      ++body;
      clamped += u < 0 || u > 1;
    }
  }
  EXPECT_EQ(result.stats.decoded.body_pixels, body);
  EXPECT_EQ(result.stats.decoded.clamped_uv, clamped);
}

TEST_F(DensePose, KeypointsLieInTheRegionThatTheDenseHeadSaw) {
  cv::Mat image = black(320, 256);
  image(cv::Rect(160, 96, 16, 16)) = kBlue;
  image(cv::Rect(40, 200, 4, 4)) = kRed;
  maq::DensePoseSettings settings;
  EXPECT_TRUE(run(image, settings).keypoints.empty()) << "nobody asked for them";
  settings.keypoints = true;
  const maq::DensePoseResult result = run(image, settings);
  ASSERT_EQ(result.people.size(), 2u);
  ASSERT_EQ(result.keypoints.size(), 2u);
  EXPECT_GT(result.stats.keypoints_ms, 0);
  for (size_t i = 0; i < 2; ++i) {
    const maq::Box& box = result.people[i].box;
    const float width = 1.06f * box.width(), height = 1.1f * box.height();  // with the margins
    for (int k = 0; k < 32; ++k) {
      const maq::Keypoint& keypoint = result.keypoints[i][size_t(k)];
      EXPECT_NEAR(keypoint.x_px, box.x0 - 0.03f * box.width() + width * (63.5f - float(k)) / 64, 1e-2) << k;
      EXPECT_NEAR(keypoint.y_px, box.y0 - 0.05f * box.height() + height * (0.5f + float(k)) / 64, 1e-2) << k;
      EXPECT_GT(keypoint.confidence, 0.99f) << k;
    }
    EXPECT_LT(result.keypoints[i][32].confidence, 0.01f) << "the tiny bundle never shows it";
  }
  EXPECT_TRUE(run(black(320, 256), settings).keypoints.empty());
}

TEST_F(DensePose, KeypointsOfCropsAndBetweenKeyFramesAreThoseOfTheSurface) {
  cv::Mat image = black(320, 256);
  image(cv::Rect(160, 96, 16, 16)) = kBlue;
  maq::DensePoseSettings settings;
  settings.keypoints = true;
  settings.crops = maq::PersonCrops::kAll;
  settings.key_frame_interval = 4;
  maq::DensePose densepose = make(settings);
  maq::DensePoseResult result;
  for (int frame = 0; frame < 3; ++frame) {
    densepose.run({MAQ_PIXEL_BGR8, image.cols, image.rows, {{image.data, image.step}, {}}}, result);
    ASSERT_EQ(result.people.size(), 1u);
    ASSERT_EQ(result.keypoints.size(), 1u) << frame;
    // The line of the tiny bundle's keypoints, from the upper right to the lower left of a crop.
    EXPECT_GT(result.keypoints[0][0].x_px, result.people[0].box.x1 - 20);
    EXPECT_LT(result.keypoints[0][0].y_px, result.people[0].box.y0 + 40);
    EXPECT_NEAR(result.keypoints[0][16].x_px - result.keypoints[0][15].x_px,
                result.keypoints[0][1].x_px - result.keypoints[0][0].x_px, 1e-3);
  }
}

TEST_F(DensePose, ABundleWithoutKeypointsSaysSo) {
  const BundleCopy bundle;
  nlohmann::json manifest = bundle.manifest();
  maq::DensePoseSettings settings;
  settings.keypoints = true;
  manifest["keypoints"]["count"] = 17;
  bundle.write_manifest(manifest);
  expect_error(MAQ_ERROR_BAD_BUNDLE, "has 17 keypoints, but must have 33", [&] { make(settings, bundle.path()); });
  manifest.erase("keypoints");
  bundle.write_manifest(manifest);
  expect_error(MAQ_ERROR_UNSUPPORTED, "has no keypoints", [&] { make(settings, bundle.path()); });
  settings.keypoints = false;
  EXPECT_NO_THROW(make(settings, bundle.path()));
}

TEST_F(DensePose, ASecondPassStartsWhereTheFirstEnded) {
  cv::Mat image = black(320, 256);
  image(cv::Rect(80, 100, 4, 4)) = kRed;
  const BundleCopy bundle;
  const auto box_of = [&](std::optional<float> second_pass_threshold, maq::DensePoseSettings settings) {
    nlohmann::json manifest = bundle.manifest();
    if (second_pass_threshold) manifest["box_head"]["second_pass_threshold"] = *second_pass_threshold;
    bundle.write_manifest(manifest);
    maq::DensePoseResult result;
    make(settings, bundle.path()).run({MAQ_PIXEL_BGR8, image.cols, image.rows, {{image.data, image.step}, {}}}, result);
    return result.people.empty() ? maq::Box{} : result.people[0].box;
  };
  const maq::Box once = box_of(std::nullopt, {});
  const maq::Box twice = box_of(0.3f, {});
  EXPECT_NEAR(once.width(), 32, 1e-3);
  EXPECT_NEAR(twice.x0, once.x0 + 3.2f, 1e-3) << "each pass moves the box by a tenth of its width";
  EXPECT_NEAR(twice.width(), once.width(), 1e-3);
  EXPECT_NEAR(box_of(1.0f, {}).x0, twice.x0, 1e-3) << "a box above the score threshold always gets a second pass";
}

TEST_F(DensePose, WhatSpeaksAgainstAPersonCountsWhereTheManifestAsksForIt) {
  const BundleCopy bundle;
  const auto people_on = [&](const cv::Scalar& background, bool asked) {
    cv::Mat image = black(320, 256);
    image = background;
    image(cv::Rect(80, 100, 4, 4)) = kRed;
    nlohmann::json manifest = bundle.manifest();
    manifest["box_head"].erase("evidence_stride");
    if (asked) manifest["box_head"]["evidence_stride"] = 16;
    bundle.write_manifest(manifest);
    maq::DensePoseResult result;
    make({}, bundle.path()).run({MAQ_PIXEL_BGR8, image.cols, image.rows, {{image.data, image.step}, {}}}, result);
    return result.people.size();
  };
  const cv::Scalar reddish = kRed * 0.1;
  EXPECT_EQ(people_on(cv::Scalar::all(0), true), 1u);
  EXPECT_EQ(people_on(reddish, true), 0u);
  EXPECT_EQ(people_on(reddish, false), 1u);
}

TEST_F(DensePose, ABoxHiddenBehindAnotherIsDropped) {
  cv::Mat image = black(320, 256);
  image(cv::Rect(160, 96, 16, 16)) = kBlue;  // a person of 128 px
  const maq::DensePoseResult alone = run(image);
  image(cv::Rect(180, 132, 4, 4)) = kRed * 0.75;  // one of 32 px inside its body, with a worse score
  const maq::DensePoseResult result = run(image);
  EXPECT_EQ(result.people.size(), 1u);
  EXPECT_EQ(result.planes.person, alone.planes.person);
  image(cv::Rect(160, 96, 16, 16)) = cv::Scalar::all(0);
  EXPECT_EQ(run(image).people.size(), 1u);  // it is seen when no person is in front
}

TEST_F(DensePose, BoxesComeBackInPixelsOfTheFrame) {
  cv::Mat image = black(640, 512);
  image(cv::Rect(160, 200, 8, 8)) = kRed;  // the cell of the first test, at twice the size
  maq::DensePoseSettings settings;
  settings.long_side_px = 320;
  const maq::DensePoseResult result = run(image, settings);
  ASSERT_EQ(result.people.size(), 1u);
  EXPECT_NEAR(result.people[0].box.x0, 2 * (80 - 16 + 3.2), 1e-3);
  EXPECT_NEAR(result.people[0].box.y1, 2 * (100 + 16), 1e-3);
  EXPECT_EQ(result.stats.network_width_px, 320);
  expect_sane(result, 640, 512);
}

TEST_F(DensePose, SmallPeopleAreSoughtInALargerInputAndLargeOnesAreKept) {
  cv::Mat image = black(640, 512);
  EXPECT_EQ(run(image).stats.network_width_px, 480) << "nobody at the smaller size";
  image(cv::Rect(320, 192, 32, 32)) = kBlue;  // a person of 256 px
  const maq::DensePoseResult large = run(image);
  ASSERT_EQ(large.people.size(), 1u);
  EXPECT_EQ(large.stats.network_width_px, 320);
  image(cv::Rect(80, 96, 8, 8)) = kRed;  // a person of 64 px: too small at 320
  const maq::DensePoseResult both = run(image);
  EXPECT_EQ(both.stats.network_width_px, 480);
  ASSERT_GE(both.people.size(), 2u);
  const auto is_large = [](const maq::Person& person) { return person.box.height() > 200; };
  EXPECT_EQ(std::count_if(both.people.begin(), both.people.end(), is_large), 1);
  expect_sane(both, 640, 512);
}

TEST_F(DensePose, WithoutPeopleTheDenseHeadDoesNotRunAndPlanesAreZero) {
  const maq::DensePoseResult result = run(black(320, 256));
  EXPECT_TRUE(result.people.empty());
  EXPECT_EQ(result.stats.dense_head_ms, 0);
  EXPECT_EQ(result.stats.decode_ms, 0);
  EXPECT_EQ(cv::countNonZero(result.planes.part), 0);
}

TEST_F(DensePose, SettingsChangeThresholdCountAndSize) {
  cv::Mat image = black(320, 256);
  for (const int x : {40, 120, 200, 280}) image(cv::Rect(x, 100, 4, 4)) = kRed;
  EXPECT_EQ(run(image).people.size(), 4u);
  EXPECT_EQ(run(image, {1, 0, -1, 2}).people.size(), 2u);
  EXPECT_EQ(run(image, {1, 0, 1, 0}).people.size(), 0u);
  const maq::DensePoseResult small = run(image, {1, 64, -1, 0});
  EXPECT_EQ(small.stats.network_width_px, 64);
  EXPECT_EQ(small.stats.network_height_px, 51);
}

TEST_F(DensePose, ExtremeFramesGiveSaneResults) {
  for (const auto& [width, height] :
       {std::pair{1, 1}, {16, 16}, {31, 33}, {1, 4000}, {4000, 1}, {320, 256}, {257, 319}}) {
    cv::Mat noise(height, width, CV_8UC3);
    cv::randu(noise, 0, 256);
    expect_sane(run(noise), width, height);
    expect_sane(run(black(width, height)), width, height);
    expect_sane(run(cv::Mat(height, width, CV_8UC3, cv::Scalar::all(255))), width, height);
  }
}

TEST_F(DensePose, BetweenKeyFramesBoxesArePropagatedAndNoNewPeopleAreFound) {
  maq::DensePoseSettings settings;
  settings.key_frame_interval = 3;
  maq::DensePose densepose = make(settings);
  maq::DensePoseResult result;
  const auto see = [&](const cv::Mat& image) {
    densepose.run({MAQ_PIXEL_BGR8, image.cols, image.rows, {{image.data, image.step}, {}}}, result);
    return result.people.size();
  };
  cv::Mat one = black(320, 256);
  one(cv::Rect(80, 100, 4, 4)) = kRed;
  cv::Mat two = one.clone();
  two(cv::Rect(200, 128, 8, 8)) = kGreen;
  EXPECT_EQ(see(one), 1u);
  EXPECT_TRUE(result.stats.key_frame);
  const float first_x0 = result.people[0].box.x0;
  EXPECT_EQ(see(two), 1u);
  EXPECT_FALSE(result.stats.key_frame);
  EXPECT_EQ(result.stats.proposals, 1);
  EXPECT_NEAR(result.people[0].box.x0, first_x0 + 3.2, 1e-3) << "this box head moves what it is given";
  EXPECT_EQ(see(black(320, 256)), 0u) << "who is gone is not made up";
  EXPECT_EQ(see(two), 2u);
  EXPECT_TRUE(result.stats.key_frame);
  EXPECT_EQ(see(black(160, 256)), 0u);
  EXPECT_TRUE(result.stats.key_frame) << "another size is another stream";
  EXPECT_EQ(see(black(160, 256)), 0u);
  EXPECT_EQ(result.stats.trunk_ms, 0) << "without boxes to propagate nothing runs";
  expect_sane(result, 160, 256);
  densepose.reset();
  EXPECT_EQ(see(black(160, 256)), 0u);
  EXPECT_TRUE(result.stats.key_frame);
}

TEST_F(DensePose, ACropIsTheDenseHeadsAnswerForTheBodyOfTheFirst) {
  cv::Mat image = black(320, 256);
  image(cv::Rect(160, 96, 16, 16)) = kBlue;  // a person of 128 px, whose body is the lower three quarters
  maq::DensePoseSettings settings;
  settings.crops = maq::PersonCrops::kAll;
  const maq::DensePoseResult first = run(image), again = run(image, settings);
  ASSERT_EQ(again.people.size(), 1u);
  EXPECT_EQ(again.stats.crops, 1);
  // The tiny dense head is sure of its parts, so that the odds rise from those of the box head.
  EXPECT_GT(again.people[0].score, first.people[0].score);
  const auto top = [](const maq::DensePoseResult& result) {
    const auto at =
        std::find_if(result.planes.part.begin(), result.planes.part.end(), [](uint8_t p) { return p != 0; });
    return int(at - result.planes.part.begin()) / 320;
  };
  // The dense head leaves out the upper quarter of whatever it sees.
  EXPECT_NEAR(top(first) - double(first.people[0].box.y0), 0.25 * 1.1 * 128 - 0.05 * 128, 1.5);
  EXPECT_NEAR(top(again) - top(first), 24, 1.5);
  expect_sane(again, 320, 256);
}

// A tiny bundle whose crops have networks of their own: those of the whole image, but U is everywhere `u`.
class BundleWithCropNetworks : public BundleCopy {
 public:
  explicit BundleWithCropNetworks(float u) {
    std::string charts = read_text(file("charts.f32"));
    const size_t parts = 24, weights = 2 * parts * 4 * 4 * 4;
    std::vector<float> values(charts.size() / sizeof(float));
    std::memcpy(values.data(), charts.data(), charts.size());
    std::fill_n(values.begin(), weights / 2, 0.0f);
    std::fill_n(values.begin() + std::ptrdiff_t(weights), parts, u);
    write_crop_charts(values);
    nlohmann::json changed = manifest();
    changed["crop_charts"]["file"] = "crop_charts.f32";
    changed["graphs"]["crop_trunk"] = changed["graphs"]["trunk"];
    changed["graphs"]["crop_trunk"]["outputs"] = {changed["graphs"]["trunk"]["outputs"][0]};
    changed["graphs"]["crop_dense_head"] = changed["graphs"]["dense_head"];
    write_manifest(changed);
  }

  void write_crop_charts(const std::vector<float>& values) {
    const std::string bytes(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(float));
    write_text(file("crop_charts.f32"), bytes);
    nlohmann::json changed = manifest();
    changed["files"]["crop_charts.f32"] = {{"sha256", maq::sha256_hex(bytes.data(), bytes.size())},
                                           {"bytes", bytes.size()}};
    write_manifest(changed);
  }
};

TEST_F(DensePose, CropsGoThroughNetworksOfTheirOwnWhereTheBundleHasThem) {
  const BundleWithCropNetworks bundle(0.25f);
  cv::Mat image = black(320, 256);
  image(cv::Rect(160, 96, 16, 16)) = kBlue;
  maq::DensePoseSettings settings;
  settings.key_frame_interval = 2;
  const auto see = [&](maq::DensePose& densepose) {
    maq::DensePoseResult result;
    densepose.run({MAQ_PIXEL_BGR8, image.cols, image.rows, {{image.data, image.step}, {}}}, result);
    expect_sane(result, image.cols, image.rows);
    EXPECT_EQ(result.people.size(), 1u);
    return result.planes;
  };
  maq::DensePose whole = make(settings, bundle.path()), whole_of_both = make(settings);
  EXPECT_EQ(see(whole).u, see(whole_of_both).u) << "without crops";
  settings.crops = maq::PersonCrops::kAll;
  maq::DensePose own = make(settings, bundle.path()), shared = make(settings);
  for (const char* frame : {"key frame", "between key frames"}) {
    const maq::DensePlanes planes = see(own), expected = see(shared);
    EXPECT_EQ(planes.part, expected.part) << frame;
    EXPECT_EQ(planes.v, expected.v) << frame;
    for (size_t i = 0; i < planes.part.size(); ++i) ASSERT_EQ(planes.u[i], planes.part[i] == 0 ? 0 : 64) << frame;
  }
}

TEST_F(DensePose, NetworksOfCropsThatDoNotFitAreRefusedWhenTheyAreLoaded) {
  maq::DensePoseSettings settings;
  settings.crops = maq::PersonCrops::kAuto;
  const auto expect_refused = [&](const BundleCopy& bundle, const std::string& text) {
    expect_error(MAQ_ERROR_BAD_BUNDLE, text, [&] { make(settings, bundle.path()); });
  };
  BundleWithCropNetworks five_channels(0.5f);
  five_channels.write_crop_charts(std::vector<float>(2 * 24 * (4 * 4 * 5 + 1), 0.5f));
  expect_refused(five_channels, "crop_charts.f32 is for 5 channels, but charts.f32 for 4");
  const BundleWithCropNetworks without_head(0.5f), other_shape(0.5f);
  nlohmann::json manifest = without_head.manifest();
  manifest["graphs"].erase("crop_dense_head");
  without_head.write_manifest(manifest);
  expect_refused(without_head, "crop_dense_head");
  manifest = other_shape.manifest();
  manifest["graphs"]["crop_dense_head"]["outputs"][0]["shape"][3] = 120;
  other_shape.write_manifest(manifest);
  expect_refused(other_shape, "graph crop_dense_head: output labels must have the shape [n, 32, 32, 160]");
}

TEST_F(DensePose, BetweenKeyFramesOnlyCropsAreComputedWhereEverybodyHasOne) {
  maq::DensePoseSettings settings;
  settings.key_frame_interval = 3;
  settings.crops = maq::PersonCrops::kAll;
  maq::DensePose densepose = make(settings);
  maq::DensePoseResult result;
  cv::Mat image = black(320, 256);
  image(cv::Rect(80, 100, 4, 4)) = kRed;
  image(cv::Rect(200, 128, 8, 8)) = kGreen;
  const auto see = [&](const cv::Mat& shown) {
    densepose.run({MAQ_PIXEL_BGR8, shown.cols, shown.rows, {{shown.data, shown.step}, {}}}, result);
    expect_sane(result, shown.cols, shown.rows);
    return result.people.size();
  };
  EXPECT_EQ(see(image), 2u);
  EXPECT_TRUE(result.stats.key_frame);
  EXPECT_GT(result.stats.trunk_ms, 0);
  const float score = result.people[0].score;
  for (int frame = 0; frame < 2; ++frame) {
    EXPECT_EQ(see(image), 2u);
    EXPECT_FALSE(result.stats.key_frame);
    EXPECT_EQ(result.stats.trunk_ms + result.stats.box_head_ms + result.stats.dense_head_ms, 0);
    EXPECT_EQ(result.stats.crops, 2);
    EXPECT_EQ(result.people[0].score, score) << "of the last key frame";
  }
  EXPECT_EQ(see(image), 2u);
  EXPECT_TRUE(result.stats.key_frame);
  EXPECT_EQ(see(black(640, 512)), 0u) << "crops of another size are of another stream";
  EXPECT_TRUE(result.stats.key_frame);
}

TEST_F(DensePose, OnlyPeopleBelowTheMinHeightMayBeMissed) {
  cv::Mat image = black(320, 256);
  image(cv::Rect(80, 100, 4, 4)) = kRed;     // 32 px, found at the finest level
  image(cv::Rect(200, 128, 8, 8)) = kGreen;  // 64 px
  maq::DensePoseSettings settings;
  settings.min_person_height_px = 70;  // sqrt(3 * 32 * 64) = 78 px
  EXPECT_EQ(run(image, settings).people.size(), 2u);
  settings.min_person_height_px = 90;
  const maq::DensePoseResult result = run(image, settings);
  ASSERT_EQ(result.people.size(), 1u);
  EXPECT_NEAR(result.people[0].box.width(), 64, 1e-3);
  cv::Mat small = black(160, 128);  // the same people, now 90 px count as 180
  small(cv::Rect(40, 50, 2, 2)) = kRed;
  settings.min_person_height_px = 45;
  EXPECT_EQ(run(small, settings).people.size(), 0u);
  settings.min_person_height_px = 35;
  EXPECT_GT(run(small, settings).people.size(), 0u);
}

TEST_F(DensePose, PartsAloneAreTheSamePartsWithoutUAndV) {
  cv::Mat image = black(320, 256);
  image(cv::Rect(160, 96, 16, 16)) = kBlue;
  maq::DensePoseSettings settings;
  settings.surface = false;
  const maq::DensePoseResult whole = run(image), parts = run(image, settings);
  EXPECT_EQ(parts.planes.part, whole.planes.part);
  EXPECT_EQ(cv::countNonZero(parts.planes.u) + cv::countNonZero(parts.planes.v), 0);
  EXPECT_EQ(parts.stats.decoded.clamped_uv, 0);
}

TEST_F(DensePose, TwoThreadsAndReusedMemoryGiveTheSameResult) {
  cv::Mat image(200, 300, CV_8UC3);
  cv::randu(image, 0, 256);
  const maq::ImageView view{MAQ_PIXEL_BGR8, 300, 200, {{image.data, image.step}, {}}};
  maq::DensePose densepose = make({2});
  maq::DensePoseResult first, again;
  densepose.run(view, first);
  densepose.run({MAQ_PIXEL_BGR8, 100, 50, {{image.data, image.step}, {}}}, again);
  densepose.run(view, again);
  const maq::DensePoseResult single = run(image);
  for (const maq::DensePoseResult* other : std::initializer_list<const maq::DensePoseResult*>{&again, &single}) {
    EXPECT_EQ(first.planes.part, other->planes.part);
    EXPECT_EQ(first.planes.u, other->planes.u);
    EXPECT_EQ(first.planes.person, other->planes.person);
    EXPECT_EQ(first.people.size(), other->people.size());
  }
}

}  // namespace
