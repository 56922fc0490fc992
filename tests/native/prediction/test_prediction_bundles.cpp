// Bundles for prediction that are not what they should be.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <random>

#include "support/expect_error.h"
#include "support/samples/tiny_prediction.h"

namespace {

using nlohmann::json;

class PredictionBundles : public testing::Test {
 protected:
  PredictionBundles() {
    std::filesystem::copy(tiny_prediction::kBundle, folder_.path(), std::filesystem::copy_options::recursive);
  }
  void open() const { tiny_prediction::encoder(folder_.path().string()); }
  void expect_refused(const json& manifest, maq_status status, const char* text) const {
    write_text(folder_.file("manifest.json"), manifest.dump());
    expect_error(status, text, [&] { open(); });
  }

  TempFolder folder_;
  const json manifest_ = json::parse(read_text(tiny_prediction::kBundle + "/manifest.json"));
};

TEST_F(PredictionBundles, OfAnotherTaskOrWithoutWhatIsReadAreRefused) {
  EXPECT_NO_THROW(open());
  json changed = manifest_;
  changed["task"] = "edges";
  expect_refused(changed, MAQ_ERROR_UNSUPPORTED, "edges");
  for (const char* key : {"frame_px", "codes"}) {
    changed = manifest_;
    changed.erase(key);
    expect_refused(changed, MAQ_ERROR_BAD_BUNDLE, key);
  }
  changed = manifest_;
  changed["codes"]["file"] = "other.maqc";
  expect_refused(changed, MAQ_ERROR_BAD_BUNDLE, "other.maqc");
  changed["codes"]["file"] = "encoder.onnx";
  expect_refused(changed, MAQ_ERROR_BAD_BUNDLE, "is not a file of codes");
  for (const json& side : {json(0), json(65536), json("64"), json(32)}) {
    changed = manifest_;
    changed["frame_px"] = side;
    expect_refused(changed, MAQ_ERROR_BAD_BUNDLE, side == json(32) ? "image [1, 32, 32, 3]" : "frame_px");
  }
}

TEST_F(PredictionBundles, WithOtherGraphsAreRefused) {
  for (const char* graph : {"encoder", "decoder"}) {
    json changed = manifest_;
    changed["graphs"].erase(graph);
    expect_refused(changed, MAQ_ERROR_BAD_BUNDLE, graph);
    for (const char* side : {"inputs", "outputs"}) {
      for (const auto& [key, value] : {std::pair<std::string, json>{"name", "other"}, {"shape", {1, 16, 16, 99}}}) {
        changed = manifest_;
        changed["graphs"][graph][side][0][key] = value;
        expect_refused(changed, MAQ_ERROR_BAD_BUNDLE, graph);
      }
    }
  }
}

TEST_F(PredictionBundles, CutOrFlippedAnywhereAreRefused) {
  std::mt19937 random(3);
  for (const char* name : {"encoder.onnx", "decoder.onnx", "codes.maqc"}) {
    const std::string whole = read_text(folder_.file(name));
    for (int i = 0; i < 20; ++i) {
      std::string bytes = whole;
      const size_t at = random() % bytes.size();
      if (i % 2 == 0) bytes.resize(at);
      if (i % 2 == 1) bytes[at] = char(bytes[at] ^ (1 << random() % 8));
      write_text(folder_.file(name), bytes);
      expect_error(MAQ_ERROR_BAD_BUNDLE, name, [&] { open(); });
    }
    write_text(folder_.file(name), whole);
  }
  EXPECT_NO_THROW(open());
}

}  // namespace
