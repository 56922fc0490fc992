// Bundles of the edge network that are not what they should be.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "support/expect_error.h"
#include "support/samples/tiny_edges.h"

namespace {

using nlohmann::json;

class EdgeBundles : public testing::Test {
 protected:
  EdgeBundles() {
    std::filesystem::copy(tiny_edges::kBundle, folder_.path(), std::filesystem::copy_options::recursive);
  }

  void open() const { maq::Edges(tiny_edges::runtime(), maq::read_bundle(folder_.path().string()), {}); }
  void expect_refused(const json& manifest, maq_status status, const char* text) const {
    write_text(folder_.file("manifest.json"), manifest.dump());
    expect_error(status, text, [&] { open(); });
  }

  TempFolder folder_;
  const json manifest_ = json::parse(read_text(tiny_edges::kBundle + "/manifest.json"));
};

TEST_F(EdgeBundles, OfAnotherTaskOrWithoutWhatIsReadAreRefused) {
  EXPECT_NO_THROW(open());
  json changed = manifest_;
  changed["task"] = "scenes";
  expect_refused(changed, MAQ_ERROR_UNSUPPORTED, "scenes");
  const auto with = [&](const char* key, const json& value) {
    json made = manifest_;
    made["field"][key] = value;
    return made;
  };
  for (const json& eps : {json(0), json(-16), json(100), json("16")}) {
    expect_refused(with("eps_r", eps), MAQ_ERROR_BAD_BUNDLE, "field.eps_r");
  }
  for (const json& multiple : {json(0), json(3), json(512), json(2.5)}) {
    expect_refused(with("multiple_px", multiple), MAQ_ERROR_BAD_BUNDLE, "field.multiple_px");
  }
  for (const json& shared : {json(2), json(true), json("1")}) {
    expect_refused(with("output_over_input", shared), MAQ_ERROR_BAD_BUNDLE, "field.output_over_input");
  }
  changed = manifest_;
  changed.erase("field");
  expect_refused(changed, MAQ_ERROR_BAD_BUNDLE, "field");
}

TEST_F(EdgeBundles, ThatWriteTheOutputOverTheInputGiveTheSame) {
  json changed = manifest_;
  changed["field"]["output_over_input"] = 1;
  write_text(folder_.file("manifest.json"), changed.dump());
  const auto apart = tiny_edges::edges();
  maq::EdgesSettings settings;
  maq::Edges shared(tiny_edges::runtime(), maq::read_bundle(folder_.path().string()), settings);
  for (int round = 0; round < 2; ++round) {
    for (const tiny_edges::Case& size : tiny_edges::kCases) {
      const std::vector<float> depth = size.read("depth");
      maq::EdgesResult expected, found;
      apart->run(tiny_edges::view_of(depth, size.width, size.height), size.intrinsics(), expected);
      shared.run(tiny_edges::view_of(depth, size.width, size.height), size.intrinsics(), found);
      EXPECT_EQ(found.field.distance_r, expected.field.distance_r) << size.name();
      EXPECT_EQ(found.field.expected_error_r, expected.field.expected_error_r);
      EXPECT_EQ(found.field.kind, expected.field.kind);
    }
  }
}

TEST_F(EdgeBundles, WithAnotherGraphAreRefused) {
  for (const auto& [side, text] : {std::pair{"inputs", "one input, slopes"}, {"outputs", "one output, planes"}}) {
    for (const auto& [key, value] : {std::pair<std::string, json>{"name", "other"},
                                     {"shape", {1, "height", "width", 7}},
                                     {"shape", {1, 12}},
                                     {"shape", {1, "height", "width", "channels"}}}) {
      json changed = manifest_;
      changed["graphs"]["field"][side][0][key] = value;
      expect_refused(changed, MAQ_ERROR_BAD_BUNDLE, text);
    }
    json changed = manifest_;
    changed["graphs"]["field"][side].push_back(changed["graphs"]["field"][side][0]);
    expect_refused(changed, MAQ_ERROR_BAD_BUNDLE, text);
  }
  std::string bytes = read_text(folder_.file("field.onnx"));
  bytes[bytes.size() / 2] = char(bytes[bytes.size() / 2] ^ 1);
  write_text(folder_.file("field.onnx"), bytes);
  expect_refused(manifest_, MAQ_ERROR_BAD_BUNDLE, "field.onnx");
}

}  // namespace
