// Edges through the C API: fields of depth frames, what is refused with which sentence, files.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <maquette/maquette.hpp>
#include <nlohmann/json.hpp>
#include <vector>

#include "support/file_size_limit.h"
#include "support/temp_folder.h"

namespace {

constexpr char kEdgesBundle[] = MAQ_TEST_DATA "/tiny_edges/bundle";

// A wall and a box before it, in millimetres.
struct DepthImage {
  explicit DepthImage(int width = 96, int height = 72) : pixels(size_t(width * height)) {
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const bool is_box = x > width / 3 && x < width / 2 && y > height / 3;
        pixels[size_t(y * width + x)] = uint16_t(x < 2 ? 0 : is_box ? 900 : 1500 + 3 * x);
      }
    }
    maq_frame_desc_init(&desc, sizeof desc);
    desc.format = MAQ_PIXEL_DEPTH16;
    desc.width_px = width;
    desc.height_px = height;
    desc.planes[0] = reinterpret_cast<const uint8_t*>(pixels.data());
    desc.intrinsics = {width, height, 80, 85, (width - 1) / 2.0, (height - 1) / 2.0, {}};
  }
  std::vector<uint16_t> pixels;
  maq_frame_desc desc;
};

class ApiEdges : public testing::Test {
 protected:
  maq_status run(const maq_frame* given) {
    maq_edges_result* result = nullptr;
    const maq_status status = maq_edges_run(edges.get(), given, &result);
    EXPECT_EQ(result != nullptr, status == MAQ_OK);
    maq_edges_result_release(result);
    return status;
  }
  void expect_refused(maq_status status, const char* text, const maq_frame* given) {
    EXPECT_EQ(run(given), status);
    EXPECT_NE(std::strstr(maq_last_error(edges.get()), text), nullptr) << maq_last_error(edges.get());
  }

  const maquette::Context context;
  const DepthImage image;
  const maquette::Frame frame{context, image.desc};
  maquette::Edges edges{context, kEdgesBundle};
};

TEST_F(ApiEdges, GivesTheFieldItsCameraAndStats) {
  const maquette::EdgesResult result = edges.run(frame);
  EXPECT_EQ(result.width_px(), 96);
  EXPECT_EQ(result.height_px(), 72);
  EXPECT_EQ(result.field().eps_r, 16);
  EXPECT_EQ(std::memcmp(&result.field().intrinsics, &image.desc.intrinsics, sizeof(maq_intrinsics)), 0);
  const std::vector<float> metres = result.distance_m();
  int64_t known = 0;
  for (size_t i = 0; i < image.pixels.size(); ++i) {
    const float depth = float(image.pixels[i]) * 0.001f, r = depth / float(std::sqrt(80.0 * 85.0));
    known += depth > 0;
    ASSERT_EQ(result.depth_m()[i], depth);
    ASSERT_NEAR(metres[i], result.distance_r()[i] * r, 1e-6);
    ASSERT_EQ(result.kind()[i] == MAQ_EDGES_KIND_NONE, result.distance_r()[i] == 16);
    ASSERT_GT(result.expected_error_r()[i], 0);
  }
  const maq_edges_stats stats = result.stats();
  EXPECT_EQ(stats.known_pixel_count, known);
  EXPECT_EQ(stats.network_pixel_count, 96 * 72);
  EXPECT_EQ(stats.broken_pixel_count, 0);
  EXPECT_GE(stats.total_ms, stats.network_ms);
  EXPECT_GT(stats.network_ms, 0);
  EXPECT_EQ(stats.provider, MAQ_PROVIDER_CPU);
}

TEST_F(ApiEdges, FramesWithoutDepthOrCalibrationAreASentence) {
  const std::vector<uint8_t> grey(96 * 72, 128);
  maq_frame_desc desc = image.desc;
  desc.format = MAQ_PIXEL_GREY8;
  desc.planes[0] = grey.data();
  const maquette::Frame picture(context, desc);
  expect_refused(MAQ_ERROR_UNSUPPORTED, "depth frames (DEPTH16, DEPTH32F)", picture.get());
  expect_refused(MAQ_ERROR_INVALID_ARGUMENT, "frame is NULL", nullptr);
  desc = image.desc;
  desc.intrinsics = {};
  expect_refused(MAQ_ERROR_UNSUPPORTED, "does not carry the intrinsics", maquette::Frame(context, desc).get());
  desc = image.desc;
  desc.intrinsics.fx_px = 0;
  expect_refused(MAQ_ERROR_INVALID_ARGUMENT, "fx_px of the intrinsics is 0", maquette::Frame(context, desc).get());
  EXPECT_EQ(run(frame.get()), MAQ_OK);
}

TEST_F(ApiEdges, WrongBundlesAreASentence) {
  const auto refused = [&](const std::string& path, maq_status status, const char* text) {
    maq_edges_config config = maquette::default_edges_config();
    config.model.bundle_path = path.c_str();
    maq_edges* made = nullptr;
    EXPECT_EQ(maq_edges_create(context.get(), &config, &made), status);
    EXPECT_EQ(made, nullptr);
    EXPECT_NE(std::strstr(maq_last_error(nullptr), text), nullptr) << maq_last_error(nullptr);
  };
  refused(MAQ_TEST_DATA "/tiny_bundle", MAQ_ERROR_UNSUPPORTED, "densepose");
  refused("/nowhere", MAQ_ERROR_NOT_FOUND, "/nowhere");
  const TempFolder folder;
  std::filesystem::copy(kEdgesBundle, folder.path());
  std::string bytes = read_text(folder.file("field.onnx"));
  bytes[bytes.size() / 2] = char(bytes[bytes.size() / 2] ^ 1);
  write_text(folder.file("field.onnx"), bytes);
  refused(folder.path().string(), MAQ_ERROR_BAD_BUNDLE, "field.onnx");
}

TEST_F(ApiEdges, FramesAtRestAreAveragedWhenAskedFor) {
  maq_edges_config config = maquette::default_edges_config();
  config.model.bundle_path = kEdgesBundle;
  for (const int32_t frames : {0, 1, 4}) {
    config.average_frames = frames;
    maquette::Edges edges_at_rest(context, config);
    edges_at_rest.run(frame);
    const maq_edges_stats stats = edges_at_rest.run(frame).stats();
    EXPECT_EQ(stats.averaged_pixel_count, frames == 4 ? stats.known_pixel_count : 0);
  }
}

TEST_F(ApiEdges, ResultsAreBoundedReusedAndOutliveEverything) {
  std::vector<maquette::EdgesResult> held;
  {
    const maquette::Context another;
    maquette::Edges made(another, kEdgesBundle);
    for (int i = 0; i < 4; ++i) held.push_back(made.run(frame));
    maq_edges_result* result = nullptr;
    EXPECT_EQ(maq_edges_run(made.get(), frame.get(), &result), MAQ_ERROR_POOL_EMPTY);
    held.pop_back();
    held.push_back(made.run(frame));
    // A result whose frame was refused goes back to the pool.
    maq_frame_desc desc = image.desc;
    desc.intrinsics = {};
    const maquette::Frame uncalibrated(another, desc);
    held.pop_back();
    for (int i = 0; i < 9; ++i) {
      EXPECT_EQ(maq_edges_run(made.get(), uncalibrated.get(), &result), MAQ_ERROR_UNSUPPORTED);
      made.cancel();
      EXPECT_EQ(maq_edges_run(made.get(), frame.get(), &result), MAQ_CANCELLED);
    }
    held.push_back(made.run(frame));
  }
  for (const maquette::EdgesResult& result : held) EXPECT_EQ(result.depth_m()[5], float(image.pixels[5]) * 0.001f);
}

TEST_F(ApiEdges, WhatIsAskedOfAResultIsChecked) {
  const maquette::EdgesResult result = edges.run(frame);
  const void* values = nullptr;
  size_t stride = 0;
  for (const int plane : {0, 5, -1}) {
    EXPECT_EQ(maq_edges_result_get_plane(result.get(), maq_edges_plane(plane), &values, &stride),
              MAQ_ERROR_INVALID_ARGUMENT);
  }
  ASSERT_EQ(maq_edges_result_get_plane(result.get(), MAQ_EDGES_PLANE_KIND, &values, &stride), MAQ_OK);
  EXPECT_EQ(stride, 96u);
  ASSERT_EQ(maq_edges_result_get_plane(result.get(), MAQ_EDGES_PLANE_DEPTH, &values, &stride), MAQ_OK);
  EXPECT_EQ(stride, 96u * 4);
  std::vector<float> metres(96 * 72);
  EXPECT_EQ(maq_edges_result_copy_distance_m(result.get(), metres.data(), metres.size() - 1),
            MAQ_ERROR_INVALID_ARGUMENT);
}

TEST_F(ApiEdges, SavesTheFieldAsFiles) {
  const TempFolder folder;
  const std::string path = folder.path().string();
  const maquette::EdgesResult result = edges.run(frame);
  result.save(path + "/a");
  const auto document = nlohmann::json::parse(read_text(folder.file("a_edges.json")));
  EXPECT_EQ(document["width"], 96);
  EXPECT_EQ(document["height"], 72);
  EXPECT_EQ(document["eps_r"], 16);
  EXPECT_EQ(document["distance_unit_r"], 0.001);
  EXPECT_EQ(document["intrinsics"]["fy_px"], 85);
  // Read back as depth, whose unit is a thousandth too.
  maquette::Source distance(context, "image:" + folder.file("a_distance.png") + "?depth_unit=0.001");
  const auto read = distance.next();
  const maq_frame_desc desc = read->desc();
  ASSERT_EQ(desc.format, MAQ_PIXEL_DEPTH16);
  for (size_t i = 0; i < image.pixels.size(); ++i) {
    uint16_t stored = 0;
    std::memcpy(&stored, desc.planes[0] + i / 96 * desc.stride_bytes[0] + 2 * (i % 96), 2);
    ASSERT_NEAR(stored, 1000 * result.distance_r()[i], 0.51);
  }
  maquette::Source kind(context, "image:" + folder.file("a_kind.png"));
  std::vector<uint8_t> bytes(96 * 72);
  kind.next()->copy_pixels(MAQ_PIXEL_GREY8, bytes.data(), 0, bytes.size());
  EXPECT_EQ(std::memcmp(bytes.data(), result.kind(), bytes.size()), 0);
}

TEST_F(ApiEdges, FilesThatCannotBeWrittenLeaveWhatWasThere) {
  const TempFolder folder;
  const std::string path = folder.path().string();
  const maquette::EdgesResult result = edges.run(frame);
  for (const std::string& wrong : {std::string(), path + "/"}) {
    EXPECT_EQ(maq_edges_result_save(result.get(), wrong.c_str()), MAQ_ERROR_INVALID_ARGUMENT) << wrong;
  }
  EXPECT_EQ(maq_edges_result_save(result.get(), "/nowhere/a"), MAQ_ERROR_UNWRITABLE);
  for (const char* name : {"a_distance.png", "a_kind.png", "a_edges.json"}) write_text(folder.file(name), name);
  {
    const FileSizeLimit limit(100);
    EXPECT_EQ(maq_edges_result_save(result.get(), (path + "/a").c_str()), MAQ_ERROR_UNWRITABLE);
  }
  for (const char* name : {"a_distance.png", "a_kind.png", "a_edges.json"}) {
    EXPECT_EQ(read_text(folder.file(name)), name);
  }
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(path), {}), 3) << "nothing else is left";
}

}  // namespace
