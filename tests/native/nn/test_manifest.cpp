#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "nn/manifest.h"
#include "support/expect_error.h"
#include "support/temp_folder.h"

namespace {

using nlohmann::json;

json tiny() { return json::parse(read_text(std::string(MAQ_TEST_DATA) + "/tiny_bundle/manifest.json")); }
maq::Manifest parse(const json& document) { return maq::parse_manifest(document.dump(), "manifest.json"); }

TEST(Manifest, ReadsEveryField) {
  const maq::Manifest manifest = parse(tiny());
  EXPECT_EQ(manifest.name, "tiny");
  EXPECT_EQ(manifest.task, "densepose");
  EXPECT_EQ(manifest.precision, "fp32");
  EXPECT_EQ(manifest.files.size(), 7u);
  EXPECT_EQ(manifest.graphs.at("trunk").outputs.size(), 6u);
  EXPECT_EQ(manifest.graphs.at("rpn_coarse").inputs.size(), 4u);
  EXPECT_EQ(std::get<int64_t>(manifest.graphs.at("trunk").outputs[0].shape[3]), 3);
  EXPECT_EQ(std::get<std::string>(manifest.graphs.at("trunk").inputs[0].shape[2]), "height");
  EXPECT_EQ(manifest.files.at("charts.f32").sha256.size(), 64u);
  EXPECT_EQ(manifest.root.at("rpn").at("nms_iou").number(0, 1), 0.7f);
}

TEST(Manifest, RefusesWhatIsNotAJsonObject) {
  for (const char* text : {"", "[]", "{", "nonsense", "\"text\""}) {
    expect_error(MAQ_ERROR_BAD_BUNDLE, "not a JSON object", [&] { maq::parse_manifest(text, "m"); });
  }
}

TEST(Manifest, SaysWhatIsNoJsonAndWhere) {
  expect_error(MAQ_ERROR_BAD_BUNDLE, "line 2, column 8", [] { maq::parse_manifest("{\n  \"a\": !}", "m"); });
  std::string text = tiny().dump();
  const std::string key = "\"nms_iou\":";
  text.replace(text.find(key) + key.size(), 3, "1e400");
  expect_error(MAQ_ERROR_BAD_BUNDLE, "number overflow parsing '1e400'", [&] { maq::parse_manifest(text, "m"); });
}

TEST(Manifest, AnErrorDoesNotQuoteAllOfAnEndlessValue) {
  json long_name = tiny();
  long_name["graphs"]["trunk"]["inputs"][0]["name"] = std::string(100000, 'x');
  std::string long_number = tiny().dump();
  const std::string key = "\"nms_iou\":";
  long_number.replace(long_number.find(key) + key.size(), 3, std::string(5000, '9'));
  for (const std::string& text : {long_name.dump(), long_number}) {
    try {
      maq::parse_manifest(text, "m");
      ADD_FAILURE() << text.size();
    } catch (const maq::Error& error) {
      EXPECT_LT(std::string(error.what()).size(), 500u) << error.what();
    }
  }
}

// Each key in turn is taken away, then given a value of a wrong type.
void expect_each_key_needed(const json& node, const json::json_pointer& at) {
  // Keys for readers, and keys of the task.
  const std::vector<std::string> free = {"licence", "training_data", "measured", "opset"};
  const std::vector<std::string> of_task = {"input", "rpn", "box_head", "dense_head", "keypoints", "charts"};
  for (const auto& [key, value] : node.items()) {
    if (std::find(free.begin(), free.end(), key) != free.end()) continue;
    if (at.empty() && std::find(of_task.begin(), of_task.end(), key) != of_task.end()) continue;
    const json::json_pointer here = at / key;
    const bool listed = at.to_string() == "/files" || at.to_string() == "/graphs";  // each may be missing
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

TEST(Manifest, NamesTheKeyOfAMistake) {
  json changed = tiny();
  changed["graphs"]["trunk"]["outputs"][1]["shape"][0] = 0;
  expect_error(MAQ_ERROR_BAD_BUNDLE, "\"graphs.trunk.outputs[1].shape[0]\" is 0, but must be 1 to",
               [&] { parse(changed); });
  changed = tiny();
  changed["files"]["charts.f32"].erase("bytes");
  expect_error(MAQ_ERROR_BAD_BUNDLE, "\"files.charts.f32.bytes\" is missing", [&] { parse(changed); });
}

TEST(Manifest, RefusesValuesOutOfRange) {
  const std::pair<const char*, json> wrong[] = {{"/files/trunk.onnx/sha256", "abc"},
                                                {"/files/trunk.onnx/bytes", -1},
                                                {"/files/trunk.onnx/bytes", UINT64_MAX},
                                                {"/graphs/trunk/file", "other.onnx"},
                                                {"/graphs/trunk/inputs", "image"},
                                                {"/format", "zip"},
                                                {"/format_version", 1.5}};
  for (const auto& [place, value] : wrong) {
    json changed = tiny();
    changed[json::json_pointer(place)] = value;
    EXPECT_THROW(parse(changed), maq::Error) << place;
  }
}

// A system keeps what it parsed after the manifest is gone.
TEST(Manifest, ANodeOutlivesItsManifest) {
  const maq::ManifestNode rpn = parse(tiny()).root.at("rpn");
  EXPECT_EQ(rpn.at("strides").elements().size(), 5u);
  expect_error(MAQ_ERROR_BAD_BUNDLE, "manifest.json: \"rpn.strides\" is not a number",
               [&] { rpn.at("strides").number(0, 1); });
}

TEST(Manifest, RefusesFilesOutsideItsFolder) {
  for (const char* name : {"../secret", "/etc/passwd", "a/b.onnx", ".."}) {
    json changed = tiny();
    changed["files"][name] = changed["files"]["trunk.onnx"];
    expect_error(MAQ_ERROR_BAD_BUNDLE, "not a plain file name", [&] { parse(changed); });
  }
}

TEST(Manifest, TellsOtherVersionsFromDamageAndWhatToDo) {
  json newer = tiny(), older = tiny();
  newer["format_version"] = int(newer["format_version"]) + 1;
  older["format_version"] = int(older["format_version"]) - 1;
  expect_error(MAQ_ERROR_UNSUPPORTED, "use a newer Maquette", [&] { parse(newer); });
  expect_error(MAQ_ERROR_UNSUPPORTED, "export it again with the export tools of this version", [&] { parse(older); });
}

TEST(Manifest, TellsOtherTasksFromDamage) {
  json other = tiny();
  other["task"] = "scene";
  expect_error(MAQ_ERROR_UNSUPPORTED, "Bundle tiny is for the task scene, but one for densepose is needed",
               [&] { parse(other).require_task("densepose"); });
  EXPECT_NO_THROW(parse(tiny()).require_task("densepose"));
}

}  // namespace
