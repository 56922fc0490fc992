#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "densepose/bundle/manifest.h"
#include "densepose/densepose.h"
#include "support/expect_error.h"
#include "support/samples/bundle_copy.h"

namespace {

using nlohmann::json;

json tiny() { return json::parse(read_text(std::string(MAQ_TEST_DATA) + "/tiny_bundle/manifest.json")); }
maq::DensePoseSpec read(const json& document) {
  return maq::read_densepose_spec(maq::parse_manifest(document.dump(), "manifest.json"));
}

TEST(DensePoseManifest, ReadsEveryField) {
  const maq::DensePoseSpec spec = read(tiny());
  EXPECT_EQ(spec.long_side_px, 320);
  EXPECT_EQ(spec.input.std[2], 255);
  EXPECT_EQ(spec.rpn.strides, (std::vector<int>{4, 8, 16, 32, 64}));
  EXPECT_EQ(spec.rpn.post_nms_top_k, 100);
  EXPECT_FLOAT_EQ(spec.box_head.delta_weights[2], 5);
  EXPECT_FALSE(spec.box_head.second_pass_threshold.has_value());
  EXPECT_EQ(spec.box_head.person_logits_stride, 0);
  EXPECT_EQ(spec.charts_file, "charts.f32");
  EXPECT_EQ(spec.dense_head.output_size, 64);
  EXPECT_EQ(spec.surface_file, "");
}

// Each key in turn is taken away, then given a value of a wrong type.
void expect_each_key_needed(const json& node, const json::json_pointer& at) {
  for (const auto& [key, value] : node.items()) {
    const json::json_pointer here = at / key;
    for (const bool remove : {true, false}) {
      json changed = tiny();
      if (remove) {
        changed[at].erase(key);
      } else {
        changed[here] = nullptr;
      }
      EXPECT_THROW(read(changed), maq::Error) << here << (remove ? " removed" : " null");
    }
    if (value.is_object()) expect_each_key_needed(value, here);
  }
}

TEST(DensePoseManifest, NeedsEachOfItsKeysWithTheRightType) {
  for (const char* part : {"input", "rpn", "box_head", "dense_head", "charts"}) {
    expect_each_key_needed(tiny()[part], json::json_pointer(std::string("/") + part));
    json changed = tiny();
    changed.erase(part);
    EXPECT_THROW(read(changed), maq::Error) << part;
  }
  for (const char* graph : {"trunk", "rpn_fine", "rpn_coarse", "box_head", "dense_head"}) {
    json changed = tiny();
    changed["graphs"].erase(graph);
    expect_error(MAQ_ERROR_BAD_BUNDLE, "\"graphs." + std::string(graph) + "\" is missing", [&] { read(changed); });
  }
}

TEST(DensePoseManifest, RefusesValuesOutOfRange) {
  const std::pair<const char*, json> wrong[] = {{"/input/std/1", 0},
                                                {"/input/long_side_px", 100000},
                                                {"/input/color", "BGR"},
                                                {"/rpn/nms_iou", 1.5},
                                                {"/rpn/pre_nms_top_k", 0},
                                                {"/rpn/strides", {4, 8}},
                                                {"/rpn/aspect_ratios", {1}},
                                                {"/box_head/max_people", 256},
                                                {"/box_head/score_threshold", -1},
                                                {"/box_head/second_pass_threshold", 2},
                                                {"/box_head/evidence_stride", 0},
                                                {"/keypoints/count", 0},
                                                {"/dense_head/index_classes", 1000},
                                                {"/dense_head/mask_threshold", 1},
                                                {"/dense_head/min_visible_fraction", 1.5},
                                                {"/charts/file", "charts.f64"},
                                                {"/surface/file", "surface.grid"}};
  for (const auto& [place, value] : wrong) {
    json changed = tiny();
    changed[json::json_pointer(place)] = value;
    EXPECT_THROW(read(changed), maq::Error) << place;
  }
}

TEST(DensePoseManifest, ABundleOfAnotherTaskIsRefused) {
  json other = tiny();
  other["task"] = "scenes";
  expect_error(MAQ_ERROR_UNSUPPORTED, "is for the task scenes, but one for densepose is needed", [&] { read(other); });
}

TEST(DensePoseManifest, ATensorThatAGraphDoesNotListIsNamed) {
  const BundleCopy no_output, no_input;
  const auto load = [](const BundleCopy& bundle) {
    const auto runtime = std::make_shared<maq::OnnxRuntimeLibrary>(MAQ_TEST_ONNXRUNTIME, maq::Log());
    const maq::DensePose densepose(runtime, maq::read_bundle(bundle.path()), {});
  };
  json manifest = no_output.manifest();
  manifest["graphs"]["trunk"]["outputs"][0]["name"] = "p7";
  no_output.write_manifest(manifest);
  expect_error(MAQ_ERROR_BAD_BUNDLE, "graph trunk lists no output p2", [&] { load(no_output); });
  manifest = no_input.manifest();
  manifest["graphs"]["trunk"]["inputs"][0]["name"] = "picture";
  no_input.write_manifest(manifest);
  expect_error(MAQ_ERROR_BAD_BUNDLE, "graph trunk lists no input image", [&] { load(no_input); });
  const BundleCopy no_evidence;
  manifest = no_evidence.manifest();
  manifest["box_head"]["evidence_stride"] = 16;
  manifest["graphs"]["trunk"]["outputs"].back()["name"] = "nobody";
  no_evidence.write_manifest(manifest);
  expect_error(MAQ_ERROR_BAD_BUNDLE, "graph trunk lists no output person", [&] { load(no_evidence); });
}

}  // namespace
