#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "support/expect_error.h"
#include "nn/manifest.h"
#include "support/temp_folder.h"

namespace {

using nlohmann::json;

json tiny() { return json::parse(read_text(std::string(MAQ_TEST_DATA) + "/tiny_bundle/manifest.json")); }
maq::Manifest parse(const json& document) { return maq::parse_manifest(document.dump(), "manifest.json"); }

TEST(Manifest, ReadsEveryField) {
  const maq::Manifest manifest = parse(tiny());
  EXPECT_EQ(manifest.name, "tiny");
  EXPECT_EQ(manifest.files.size(), 6u);
  EXPECT_EQ(manifest.graphs.at("trunk").outputs.size(), 5u);
  EXPECT_EQ(manifest.graphs.at("rpn_coarse").inputs.size(), 4u);
  EXPECT_EQ(manifest.dense_head.charts_file, "charts.f32");
  EXPECT_EQ(std::get<int64_t>(manifest.graphs.at("trunk").outputs[0].shape[3]), 3);
  EXPECT_EQ(std::get<std::string>(manifest.graphs.at("trunk").inputs[0].shape[2]), "height");
  EXPECT_EQ(manifest.input.long_side_px, 320);
  EXPECT_EQ(manifest.rpn.strides, (std::vector<int>{4, 8, 16, 32, 64}));
  EXPECT_FLOAT_EQ(manifest.box_head.delta_weights[2], 5);
  EXPECT_EQ(manifest.dense_head.output, 64);
}

TEST(Manifest, RefusesWhatIsNoJsonObject) {
  for (const char* text : {"", "[]", "{", "nonsense", "\"text\""}) {
    expect_error(MAQ_ERROR_BAD_BUNDLE, "not a JSON object", [&] { maq::parse_manifest(text, "m"); });
  }
}

// Each key in turn is taken away, then given a value of a wrong type.
void expect_each_key_needed(const json& node, const json::json_pointer& at) {
  // What a person reads and what is listed by name is free.
  const std::vector<std::string> free = {"licence", "training_data", "measured", "opset"};
  for (const auto& [key, value] : node.items()) {
    if (std::find(free.begin(), free.end(), key) != free.end()) continue;
    const json::json_pointer here = at / key;
    const bool listed = at.to_string() == "/files";
    for (const bool remove : {true, false}) {
      if (remove && listed) continue;
      json changed = tiny();
      if (remove) {
        changed[at].erase(key);
      } else {
        changed[here] = nullptr;
      }
      EXPECT_THROW(parse(changed), maq::Error) << here << (remove ? " removed" : " null");
    }
    if (value.is_object()) expect_each_key_needed(value, here);
  }
}

TEST(Manifest, NeedsEachOfItsKeysWithTheRightType) { expect_each_key_needed(tiny(), json::json_pointer("")); }

TEST(Manifest, NamesThePlaceOfAMistake) {
  json changed = tiny();
  changed["rpn"]["strides"][2] = "many";
  expect_error(MAQ_ERROR_BAD_BUNDLE, "\"rpn.strides[2]\" is not a whole number", [&] { parse(changed); });
  changed = tiny();
  changed["box_head"].erase("nms_iou");
  expect_error(MAQ_ERROR_BAD_BUNDLE, "\"box_head.nms_iou\" is missing", [&] { parse(changed); });
}

TEST(Manifest, RefusesValuesOutOfRange) {
  const std::pair<const char*, json> wrong[] = {{"/input/std/1", 0},
                                                {"/input/long_side", 100000},
                                                {"/rpn/nms_iou", 1.5},
                                                {"/rpn/pre_nms_top_k", 0},
                                                {"/rpn/strides", {4, 8}},
                                                {"/rpn/aspect_ratios", {1}},
                                                {"/box_head/max_people", 256},
                                                {"/box_head/score_threshold", -1},
                                                {"/box_head/second_look_score", 2},
                                                {"/dense_head/index_classes", 1000},
                                                {"/dense_head/mask_threshold", 1},
                                                {"/dense_head/least_own_share", 1.5},
                                                {"/files/trunk.onnx/sha256", "abc"},
                                                {"/graphs/trunk/file", "other.onnx"},
                                                {"/input/color", "BGR"}};
  for (const auto& [place, value] : wrong) {
    json changed = tiny();
    changed[json::json_pointer(place)] = value;
    EXPECT_THROW(parse(changed), maq::Error) << place;
  }
}

TEST(Manifest, RefusesFilesOutsideItsFolder) {
  for (const char* name : {"../secret", "/etc/passwd", "a/b.onnx", ".."}) {
    json changed = tiny();
    changed["files"][name] = changed["files"]["trunk.onnx"];
    expect_error(MAQ_ERROR_BAD_BUNDLE, "not a plain file name", [&] { parse(changed); });
  }
}

TEST(Manifest, TellsOtherVersionsAndTasksFromDamage) {
  json newer = tiny(), other = tiny();
  newer["format_version"] = 4;
  other["task"] = "scene";
  expect_error(MAQ_ERROR_UNSUPPORTED, "format version 4", [&] { parse(newer); });
  expect_error(MAQ_ERROR_UNSUPPORTED, "scene", [&] { parse(other); });
}

}  // namespace
