// Bundles of scene networks: what is read of them, what is refused, and sessions for sizes.
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "nn/sha256.h"
#include "support/expect_error.h"
#include "support/samples/tiny_scene.h"

namespace {

using nlohmann::json;

class SceneNetworks : public testing::Test {
 protected:
  SceneNetworks() {
    std::filesystem::copy(tiny_scene::kFolder + "/bundle", folder_.path(), std::filesystem::copy_options::recursive);
  }

  std::unique_ptr<maq::SceneNetworks> open() const {
    return std::make_unique<maq::SceneNetworks>(tiny_scene::runtime(), maq::read_bundle(folder_.path().string()),
                                                maq::SessionSettings{});
  }
  json manifest() const { return json::parse(read_text(folder_.file("manifest.json"))); }
  void write_manifest(const json& manifest) const { write_text(folder_.file("manifest.json"), manifest.dump()); }
  void replace(const std::string& name, const std::string& content) const {
    write_text(folder_.file(name), content);
    json changed = manifest();
    changed["files"][name] = {{"sha256", maq::sha256_hex(content.data(), content.size())}, {"bytes", content.size()}};
    write_manifest(changed);
  }

  TempFolder folder_;
};

TEST_F(SceneNetworks, SayWhatTheRefinerReads) {
  const auto networks = tiny_scene::networks();
  EXPECT_EQ(networks->name(), "tiny-scenes");
  EXPECT_EQ(networks->refiner_layout().levels, 5);
  EXPECT_TRUE(networks->refiner_layout().is_space_to_depth);
  EXPECT_EQ(networks->refiner_layout().raster_shape(0, 96, 64), (maq::Shape{1, 32, 48, 36}));
  EXPECT_EQ(networks->refiner_layout().raster_shape(2, 96, 64), (maq::Shape{1, 16, 24, 9}));
  EXPECT_EQ(networks->refiner_layout().picture_shape(96, 64), (maq::Shape{1, 32, 48, 12}));
}

// The extractor passes the photo's colours through as its first features.
TEST_F(SceneNetworks, PhotosOfSeveralSizesTakeTurns) {
  const auto networks = tiny_scene::networks();
  for (const auto& [width, height] : {std::pair{64, 32}, {32, 96}, {64, 32}, {96, 96}, {128, 32}, {64, 32}}) {
    std::vector<float> photo(size_t(width * height * 3));
    for (size_t i = 0; i < photo.size(); ++i) photo[i] = float(i % 251) / 251;
    const float* features = networks->extract(photo.data(), width, height);
    for (size_t pixel = 0; pixel < size_t(width * height); ++pixel) {
      for (size_t colour = 0; colour < 3; ++colour) {
        ASSERT_EQ(features[pixel * maq::kFeatures + colour], photo[3 * pixel + colour]) << width << " x " << height;
      }
    }
  }
}

TEST_F(SceneNetworks, PicturesOfSeveralSizesTakeTurns) {
  const auto networks = tiny_scene::networks();
  std::vector<float> first;
  for (const auto& [width, height] : {std::pair{64, 48}, {32, 16}, {16, 16}, {80, 32}, {64, 48}}) {
    std::vector<std::vector<float>> rasters;
    std::vector<const float*> given;
    for (int level = 0; level < networks->refiner_layout().levels; ++level) {
      size_t size = 1;
      for (const int64_t extent : networks->refiner_layout().raster_shape(level, width, height)) size *= size_t(extent);
      rasters.emplace_back(size);
      for (size_t i = 0; i < size; ++i) rasters.back()[i] = float(i % 97) / 97;
    }
    for (const auto& raster : rasters) given.push_back(raster.data());
    const float* picture = networks->refine(given, width, height);
    const std::vector<float> values(picture, picture + width * height * 3);
    EXPECT_TRUE(std::all_of(values.begin(), values.end(), [](float value) { return std::isfinite(value); }));
    EXPECT_NE(*std::min_element(values.begin(), values.end()), *std::max_element(values.begin(), values.end()));
    if (width == 64 && first.empty()) first = values;
    if (width == 64) {
      EXPECT_EQ(values, first) << "the first size again";
    }
  }
}

TEST_F(SceneNetworks, OtherSizesAreRefused) {
  const auto networks = tiny_scene::networks();
  const std::vector<float> photo(100);
  for (const auto& [width, height] : {std::pair{40, 32}, {32, 31}, {0, 32}, {-32, 32}}) {
    expect_error(MAQ_ERROR_INVALID_ARGUMENT, "multiples of 32",
                 [&, w = width, h = height] { networks->extract(photo.data(), w, h); });
  }
  expect_error(MAQ_ERROR_IMAGE_SIZE, "over the limit", [&] { networks->extract(photo.data(), 1 << 20, 1 << 20); });
  expect_error(MAQ_ERROR_INVALID_ARGUMENT, "takes 5 rasters, but 1", [&] { networks->refine({photo.data()}, 32, 32); });
}

TEST_F(SceneNetworks, AreToldApartByTheirFiles) {
  const auto a = tiny_scene::networks(), b = tiny_scene::networks();
  EXPECT_EQ(a->sha256(), b->sha256());
  const json manifest = json::parse(read_text(tiny_scene::kFolder + "/bundle/manifest.json"));
  std::string digests;
  for (const char* file : {"extractor.onnx", "refiner.onnx", "basis.bin"}) {
    digests += manifest["files"][file]["sha256"].get<std::string>();
  }
  std::string hex;
  for (const uint8_t byte : a->sha256()) {
    constexpr char kDigits[] = "0123456789abcdef";
    hex += {kDigits[byte >> 4], kDigits[byte & 15]};
  }
  EXPECT_EQ(hex, maq::sha256_hex(digests.data(), digests.size()));
}

TEST_F(SceneNetworks, ABasisOfAnotherSizeOrWithoutNumbersIsRefused) {
  const std::string bytes = read_text(folder_.file("basis.bin"));
  replace("basis.bin", bytes.substr(4));
  expect_error(MAQ_ERROR_BAD_BUNDLE, "basis.bin has 2708 bytes, but must have 2712", [&] { open(); });
  for (const float value : {std::nanf(""), INFINITY, 1e9f}) {
    std::string changed = bytes;
    std::memcpy(changed.data() + 400, &value, sizeof value);
    replace("basis.bin", changed);
    expect_error(MAQ_ERROR_BAD_BUNDLE, "basis.bin has the weight", [&] { open(); });
  }
}

TEST_F(SceneNetworks, GraphsOfAnotherInterfaceAreRefused) {
  const json whole = manifest();
  const auto refused = [&](const char* at, const json& value, const char* text) {
    json changed = whole;
    changed[json::json_pointer(at)] = value;
    write_manifest(changed);
    expect_error(MAQ_ERROR_BAD_BUNDLE, text, [&] { open(); });
  };
  refused("/graphs/extractor/inputs/0/name", "photo", "must have the input image");
  refused("/graphs/extractor/outputs/0/shape/3", 7, "the output features [1, height, width, 8]");
  refused("/graphs/refiner/inputs/1/name", "raster2", "must be raster1");
  refused("/graphs/refiner/inputs/0/shape/3", 18, "must be raster0");
  refused("/graphs/refiner/inputs/0/shape", json::array({1, 36}), "must be raster0");
  refused("/graphs/refiner/inputs", json::array(), "has 0 inputs");
  refused("/graphs/refiner/outputs/0/shape/3", 3, "rgb with 12 channels");
  refused("/basis/file", "weights.bin", "which \"files\" does not list");
}

// A fault that only the graph itself shows is found when the graph is first used.
TEST_F(SceneNetworks, AGraphThatIsNotTheManifestsIsSeenWhenItIsUsed) {
  replace("extractor.onnx", read_text(folder_.file("refiner.onnx")));
  const auto networks = open();
  const std::vector<float> photo(32 * 32 * 3);
  expect_error(MAQ_ERROR_BAD_BUNDLE, "extractor.onnx has no input image",
               [&] { networks->extract(photo.data(), 32, 32); });
}

}  // namespace
