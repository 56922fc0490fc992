#include <gtest/gtest.h>

#include "support/bundle_copy.h"
#include "core/log.h"
#include "densepose/densepose.h"
#include "support/expect_error.h"
#include "nn/bundle.h"
#include "nn/sha256.h"

namespace {

std::shared_ptr<const maq::OnnxRuntimeLibrary> runtime() {
  return std::make_shared<maq::OnnxRuntimeLibrary>(MAQ_TEST_ONNXRUNTIME, maq::Log());
}

void load(const BundleCopy& bundle) {
  const maq::Bundle read = maq::read_bundle(bundle.path());
  const maq::DensePose densepose(runtime(), read, {});
}

// Puts `content` in place of a file and its hash into the manifest, as one who makes a bundle could.
void replace_file(const BundleCopy& bundle, const std::string& name, const std::string& content) {
  write_text(bundle.file(name), content);
  nlohmann::json manifest = bundle.manifest();
  manifest["files"][name] = {{"sha256", maq::sha256_hex(content.data(), content.size())}, {"bytes", content.size()}};
  bundle.write_manifest(manifest);
}

TEST(Bundle, AWholeOneLoads) { EXPECT_NO_THROW(load(BundleCopy())); }

TEST(Bundle, AMissingFolderOrManifestIsNotFound) {
  const TempFolder empty;
  expect_error(MAQ_ERROR_NOT_FOUND, "is not a folder", [&] { maq::read_bundle(empty.file("none")); });
  expect_error(MAQ_ERROR_NOT_FOUND, "no manifest.json", [&] { maq::read_bundle(empty.path().string()); });
}

TEST(Bundle, AChangedByteIsSeen) {
  for (const char* name : {"trunk.onnx", "box_head.onnx", "dense_head.onnx"}) {
    const BundleCopy bundle;
    bundle.flip_byte(name);
    expect_error(MAQ_ERROR_BAD_BUNDLE, std::string(name) + " has SHA-256", [&] { load(bundle); });
  }
}

TEST(Bundle, ACutOrMissingFileIsSeen) {
  const BundleCopy cut, missing;
  const std::string bytes = read_text(cut.file("trunk.onnx"));
  write_text(cut.file("trunk.onnx"), bytes.substr(0, bytes.size() - 1));
  expect_error(MAQ_ERROR_BAD_BUNDLE, "incomplete", [&] { load(cut); });
  std::filesystem::remove(missing.file("box_head.onnx"));
  expect_error(MAQ_ERROR_BAD_BUNDLE, "box_head.onnx is missing", [&] { load(missing); });
}

TEST(Bundle, AFileThatIsNoNetworkIsSeen) {
  const BundleCopy bundle;
  replace_file(bundle, "trunk.onnx", "no network, but its hash is right");
  expect_error(MAQ_ERROR_BAD_BUNDLE, "trunk.onnx cannot be loaded", [&] { load(bundle); });
}

TEST(Bundle, WeightsInAnotherFileAreRefused) {
  const BundleCopy bundle;
  // An initializer of the graph (fields 7 and 5) with external data (field 13): location = "w".
  const std::string entry = std::string("\x0a\x08location\x12\x01w");
  const std::string tensor = std::string("\x6a") + char(entry.size()) + entry;
  const std::string graph = std::string("\x2a") + char(tensor.size()) + tensor;
  replace_file(bundle, "box_head.onnx", read_text(bundle.file("box_head.onnx")) + "\x3a" + char(graph.size()) + graph);
  expect_error(MAQ_ERROR_BAD_BUNDLE, "box_head.onnx keeps weights in another file", [&] { load(bundle); });
}

TEST(Bundle, ANetworkInTheWrongPlaceIsSeen) {
  const BundleCopy bundle;
  replace_file(bundle, "box_head.onnx", read_text(bundle.file("dense_head.onnx")));
  expect_error(MAQ_ERROR_BAD_BUNDLE, "box_head.onnx", [&] { load(bundle); });
}

TEST(Bundle, AShapeThatIsNotTheManifestsIsSeen) {
  const BundleCopy bundle;
  nlohmann::json manifest = bundle.manifest();
  manifest["graphs"]["dense_head"]["outputs"][0]["shape"][3] = 2;
  bundle.write_manifest(manifest);
  expect_error(MAQ_ERROR_BAD_BUNDLE, "output labels has shape [?, 32, 32, 160] in the graph", [&] { load(bundle); });
}

TEST(Bundle, AMissingTensorIsSeenInTheGraphAndInTheManifest) {
  const BundleCopy in_graph, in_manifest;
  nlohmann::json manifest = in_graph.manifest();
  manifest["graphs"]["trunk"]["outputs"][0]["name"] = "p7";
  in_graph.write_manifest(manifest);
  expect_error(MAQ_ERROR_BAD_BUNDLE, "graph trunk lists no output p2", [&] { load(in_graph); });
  manifest = in_manifest.manifest();
  manifest["graphs"]["trunk"]["inputs"][0]["name"] = "picture";
  in_manifest.write_manifest(manifest);
  expect_error(MAQ_ERROR_BAD_BUNDLE, "graph trunk lists no input image", [&] { load(in_manifest); });
}

TEST(Bundle, ATypeOtherThanFloatIsSeen) {
  const BundleCopy bundle;
  nlohmann::json manifest = bundle.manifest();
  manifest["graphs"]["trunk"]["inputs"][0]["type"] = "uint8";
  bundle.write_manifest(manifest);
  expect_error(MAQ_ERROR_BAD_BUNDLE, "must be float32", [&] { load(bundle); });
}

TEST(Bundle, AMissingRuntimeLibraryIsNamedWithARemedy) {
  const TempFolder folder;
  expect_error(MAQ_ERROR_RUNTIME_LIBRARY, folder.file("none.so"),
               [&] { maq::OnnxRuntimeLibrary(folder.file("none.so"), maq::Log()); });
  write_text(folder.file("text.so"), "no library");
  expect_error(MAQ_ERROR_RUNTIME_LIBRARY, "cannot be opened",
               [&] { maq::OnnxRuntimeLibrary(folder.file("text.so"), maq::Log()); });
  expect_error(MAQ_ERROR_RUNTIME_LIBRARY, "is not ONNX Runtime",
               [&] { maq::OnnxRuntimeLibrary("libm.so.6", maq::Log()); });
}

TEST(Bundle, TelemetryIsOffBeforeTheLibraryIsOpened) {
  unsetenv("ORT_DISABLE_TELEMETRY");
  const auto library = runtime();
  EXPECT_STREQ(std::getenv("ORT_DISABLE_TELEMETRY"), "1");
}

}  // namespace
