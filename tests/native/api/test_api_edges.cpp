// Edges through the C API: fields of depth frames, what is refused with which sentence, files.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <limits>
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
  EXPECT_EQ(maq_edges_run(nullptr, frame.get(), nullptr), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(maq_edges_run(edges.get(), frame.get(), nullptr), MAQ_ERROR_INVALID_ARGUMENT);
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

TEST_F(ApiEdges, SettingsOutOfRangeAreRefused) {
  const auto refused = [&](const maq_edges_config& config, const char* text) {
    maq_edges* made = nullptr;
    EXPECT_EQ(maq_edges_create(context.get(), &config, &made), MAQ_ERROR_INVALID_ARGUMENT);
    EXPECT_NE(std::strstr(maq_last_error(nullptr), text), nullptr) << maq_last_error(nullptr);
  };
  maq_edges_config config = maquette::default_edges_config();
  config.model.threads = -2;
  refused(config, "config.model.threads is -2, but must be 0 to 64, or MAQ_THREADS_MEASURED (-1).");
  config.model.threads = 65;
  refused(config, "config.model.threads is 65");
  config = maquette::default_edges_config();
  config.result_pool_size = 65;
  refused(config, "config.result_pool_size");
  config = maquette::default_edges_config();
  reinterpret_cast<int32_t&>(config.model.spinning) = 3;
  refused(config, "config.model.spinning");
  for (const int32_t frames : {-1, 65}) {
    config = maquette::default_edges_config();
    config.average_frames = frames;
    refused(config, "config.average_frames");
  }
  config = maquette::default_edges_config();
  reinterpret_cast<int32_t&>(config.model.provider) = 9;
  refused(config, "config.model.provider");
  config = maquette::default_edges_config();
  config.struct_size = 4;
  refused(config, "config.struct_size is 4");
  EXPECT_EQ(maq_edges_config_init(nullptr, sizeof config), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(maq_edges_config_init(&config, 4), MAQ_ERROR_INVALID_ARGUMENT);
}

TEST_F(ApiEdges, MeasuredThreadsAreAFewAndGiveTheSame) {
  maq_edges_config config = maquette::default_edges_config();
  config.model.bundle_path = kEdgesBundle;
  config.model.threads = 3;
  const maquette::EdgesResult expected = maquette::Edges(context, config).run(frame);
  config.model.threads = MAQ_THREADS_MEASURED;
  const maquette::EdgesResult found = maquette::Edges(context, config).run(frame);
  EXPECT_EQ(expected.stats().threads, 3);
  EXPECT_EQ(expected.stats().is_threads_measured, 0);
  EXPECT_GE(found.stats().threads, 1);
  EXPECT_LE(found.stats().threads, 4);
  EXPECT_EQ(found.stats().is_threads_measured, 1);
  EXPECT_EQ(std::memcmp(found.distance_r(), expected.distance_r(), image.pixels.size() * sizeof(float)), 0);
  EXPECT_EQ(found.stats().network_pixel_count, 96 * 72);
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

TEST_F(ApiEdges, ABundleInMemoryGivesTheSame) {
  std::vector<std::pair<std::string, std::string>> contents;
  for (const char* name : {"manifest.json", "field.onnx"}) {
    contents.emplace_back(name, read_text(std::string(kEdgesBundle) + "/" + name));
  }
  std::vector<maq_memory_file> files;
  for (const auto& [name, bytes] : contents) files.push_back({name.c_str(), bytes.data(), bytes.size()});
  maq_edges_config config = maquette::default_edges_config();
  config.model.bundle_files = files.data();
  config.model.bundle_file_count = uint32_t(files.size());
  maquette::Edges in_memory(context, config);
  for (auto& [name, bytes] : contents) bytes.assign(bytes.size(), 'x');
  const maquette::EdgesResult found = in_memory.run(frame), expected = edges.run(frame);
  EXPECT_EQ(std::memcmp(found.distance_r(), expected.distance_r(), image.pixels.size() * sizeof(float)), 0);
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
  EXPECT_EQ(maq_edges_result_get_plane(result.get(), MAQ_EDGES_PLANE_KIND, nullptr, &stride),
            MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(maq_edges_result_get_plane(result.get(), MAQ_EDGES_PLANE_KIND, &values, nullptr),
            MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(maq_edges_result_get_plane(nullptr, MAQ_EDGES_PLANE_KIND, &values, &stride), MAQ_ERROR_INVALID_ARGUMENT);
  std::vector<float> metres(96 * 72);
  EXPECT_EQ(maq_edges_result_copy_distance_m(result.get(), metres.data(), metres.size() - 1),
            MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(maq_edges_result_copy_distance_m(result.get(), nullptr, metres.size()), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(maq_edges_result_copy_distance_m(nullptr, metres.data(), metres.size()), MAQ_ERROR_INVALID_ARGUMENT);
  maq_edges_field field{};
  EXPECT_EQ(maq_edges_result_get_field(result.get(), &field), MAQ_ERROR_INVALID_ARGUMENT) << "struct_size";
  EXPECT_EQ(maq_edges_result_get_field(result.get(), nullptr), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(maq_edges_result_get_field(nullptr, &field), MAQ_ERROR_INVALID_ARGUMENT);
  maq_edges_stats stats{};
  EXPECT_EQ(maq_edges_result_get_stats(result.get(), &stats), MAQ_ERROR_INVALID_ARGUMENT) << "struct_size";
  EXPECT_EQ(maq_edges_result_get_stats(nullptr, &stats), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(maq_edges_cancel(nullptr), MAQ_ERROR_INVALID_ARGUMENT);
  maq_edges_destroy(nullptr);
  maq_edges_result_release(nullptr);
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
  EXPECT_EQ(maq_edges_result_save(nullptr, "a"), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(maq_edges_result_save(result.get(), nullptr), MAQ_ERROR_INVALID_ARGUMENT);
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
