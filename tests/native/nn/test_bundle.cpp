#include <gtest/gtest.h>

#include "core/log.h"
#include "nn/bundle.h"
#include "nn/session.h"
#include "nn/sha256.h"
#include "support/expect_error.h"
#include "support/samples/bundle_copy.h"

namespace {

std::shared_ptr<const maq::OnnxRuntimeLibrary> runtime() {
  return std::make_shared<maq::OnnxRuntimeLibrary>(MAQ_TEST_ONNXRUNTIME, maq::Log());
}

// Makes a session of each graph.
void open_graphs(const maq::Bundle& bundle) {
  const auto library = runtime();
  for (const auto& [name, graph] : bundle.manifest.graphs) {
    maq::open_session(library, bundle.files.at(graph.file), graph, bundle.path_of(graph.file), {});
  }
}

void load(const BundleCopy& copy) { open_graphs(maq::read_bundle(copy.path())); }

// The files of a bundle's folder as an app without a file system has them.
struct InMemory {
  explicit InMemory(const BundleCopy& bundle) {
    for (const auto& entry : std::filesystem::directory_iterator(bundle.path())) {
      const std::string name = entry.path().filename().string();
      contents[name] = read_text(bundle.file(name));
    }
  }
  std::vector<maq::NamedBuffer> buffers() const {
    std::vector<maq::NamedBuffer> all;
    for (const auto& [name, bytes] : contents) all.push_back({name, bytes.data(), bytes.size()});
    return all;
  }

  std::map<std::string, std::string> contents;
};

// Puts `content` in place of a file and its hash into the manifest, as one who makes a bundle could.
void replace_file(const BundleCopy& bundle, const std::string& name, const std::string& content) {
  write_text(bundle.file(name), content);
  nlohmann::json manifest = bundle.manifest();
  manifest["files"][name] = {{"sha256", maq::sha256_hex(content.data(), content.size())}, {"bytes", content.size()}};
  bundle.write_manifest(manifest);
}

TEST(Bundle, AnIntactBundleLoads) { EXPECT_NO_THROW(load(BundleCopy())); }

TEST(Bundle, AMissingFolderOrManifestIsNotFound) {
  const TempFolder empty;
  expect_error(MAQ_ERROR_NOT_FOUND, "is not a folder", [&] { maq::read_bundle(empty.file("none")); });
  expect_error(MAQ_ERROR_NOT_FOUND, "no manifest.json", [&] { maq::read_bundle(empty.path().string()); });
}

TEST(Bundle, AFileOfAnotherSizeIsNotRead) {
  const BundleCopy long_file;
  std::filesystem::resize_file(long_file.file("trunk.onnx"), uint64_t(1) << 40);  // a hole: it takes no disk
  expect_error(MAQ_ERROR_BAD_BUNDLE, "has 1099511627776 bytes, but the manifest says",
               [&] { maq::read_bundle(long_file.path()); });
  const BundleCopy endless;
  std::filesystem::remove(endless.file("manifest.json"));
  std::filesystem::create_symlink("/dev/zero", endless.file("manifest.json"));
  expect_error(MAQ_ERROR_UNREADABLE, "is not a file but a device", [&] { maq::read_bundle(endless.path()); });
  const BundleCopy with_long_manifest;
  std::filesystem::resize_file(with_long_manifest.file("manifest.json"), (1 << 24) + 1);
  expect_error(MAQ_ERROR_UNREADABLE, "is over 16 MiB", [&] { maq::read_bundle(with_long_manifest.path()); });
}

TEST(Bundle, AChangedByteIsRefused) {
  for (const char* name : {"trunk.onnx", "box_head.onnx", "dense_head.onnx"}) {
    const BundleCopy bundle;
    bundle.flip_byte(name);
    expect_error(MAQ_ERROR_BAD_BUNDLE, std::string(name) + " has SHA-256", [&] { load(bundle); });
  }
}

TEST(Bundle, ATruncatedOrMissingFileIsRefused) {
  const BundleCopy cut, missing;
  const std::string bytes = read_text(cut.file("trunk.onnx"));
  write_text(cut.file("trunk.onnx"), bytes.substr(0, bytes.size() - 1));
  expect_error(MAQ_ERROR_BAD_BUNDLE, "incomplete", [&] { load(cut); });
  std::filesystem::remove(missing.file("box_head.onnx"));
  expect_error(MAQ_ERROR_BAD_BUNDLE, "box_head.onnx is missing", [&] { load(missing); });
}

TEST(Bundle, AFileThatIsNotANetworkIsRefused) {
  const BundleCopy bundle;
  replace_file(bundle, "trunk.onnx", "no network, but its hash is right");
  expect_error(MAQ_ERROR_BAD_BUNDLE, "trunk.onnx cannot be loaded", [&] { load(bundle); });
}

TEST(Bundle, ARefusalDoesNotNameFunctionsOfTheRuntime) {
  const BundleCopy bundle;
  // A sparse initializer (fields 7 and 15) without a name.
  replace_file(bundle, "box_head.onnx", read_text(bundle.file("box_head.onnx")) + std::string("\x3a\x02\x7a\x00", 4));
  try {
    load(bundle);
    FAIL();
  } catch (const maq::Error& error) {
    const std::string text = error.what();
    EXPECT_NE(text.find("Sparse initializer must have a name"), std::string::npos) << text;
    EXPECT_EQ(text.find("onnxruntime"), std::string::npos) << text;
    EXPECT_EQ(text.find('\n'), std::string::npos) << text;
  }
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

TEST(Bundle, ANetworkUnderTheNameOfAnotherIsRefused) {
  const BundleCopy bundle;
  replace_file(bundle, "box_head.onnx", read_text(bundle.file("dense_head.onnx")));
  expect_error(MAQ_ERROR_BAD_BUNDLE, "box_head.onnx", [&] { load(bundle); });
}

TEST(Bundle, AShapeOtherThanTheManifestsIsRefused) {
  const BundleCopy bundle;
  nlohmann::json manifest = bundle.manifest();
  manifest["graphs"]["dense_head"]["outputs"][0]["shape"][3] = 2;
  bundle.write_manifest(manifest);
  expect_error(MAQ_ERROR_BAD_BUNDLE, "output labels has shape [?, 32, 32, 160] in the graph", [&] { load(bundle); });
}

TEST(Bundle, AMissingTensorIsRefused) {
  const BundleCopy bundle;
  nlohmann::json manifest = bundle.manifest();
  manifest["graphs"]["trunk"]["outputs"][0]["name"] = "p7";
  bundle.write_manifest(manifest);
  expect_error(MAQ_ERROR_BAD_BUNDLE, "trunk.onnx has no output p7", [&] { load(bundle); });
}

TEST(Bundle, ATypeOtherThanFloatIsRefused) {
  const BundleCopy bundle;
  nlohmann::json manifest = bundle.manifest();
  manifest["graphs"]["trunk"]["inputs"][0]["type"] = "uint8";
  bundle.write_manifest(manifest);
  expect_error(MAQ_ERROR_BAD_BUNDLE, "must be float32", [&] { load(bundle); });
}

TEST(Bundle, FromMemoryIsTheSameAsFromItsFolder) {
  const BundleCopy folder;
  const InMemory memory(folder);
  const maq::Bundle read = maq::read_bundle(folder.path()), given = maq::read_bundle(memory.buffers());
  EXPECT_EQ(given.files, read.files);
  EXPECT_EQ(given.manifest.name, read.manifest.name);
  EXPECT_EQ(given.manifest.graphs.size(), read.manifest.graphs.size());
  EXPECT_EQ(given.path_of("trunk.onnx"), "memory:trunk.onnx");
  EXPECT_NO_THROW(open_graphs(given));
}

TEST(Bundle, FromMemoryDoesNotNeedTheBuffersAfterwards) {
  auto memory = std::make_unique<InMemory>(BundleCopy());
  const maq::Bundle given = maq::read_bundle(memory->buffers());
  for (auto& [name, bytes] : memory->contents) std::fill(bytes.begin(), bytes.end(), '\x7f');
  memory.reset();
  EXPECT_NO_THROW(open_graphs(given));
}

TEST(Bundle, FromMemoryIsCheckedLikeAFolder) {
  InMemory changed{BundleCopy()}, cut = changed, missing = changed, outside = changed;
  std::string& trunk = changed.contents["trunk.onnx"];
  trunk[trunk.size() / 2] = char(trunk[trunk.size() / 2] ^ 1);
  expect_error(MAQ_ERROR_BAD_BUNDLE, "memory:trunk.onnx has SHA-256", [&] { maq::read_bundle(changed.buffers()); });
  cut.contents["charts.f32"].pop_back();
  expect_error(MAQ_ERROR_BAD_BUNDLE, "memory:charts.f32 has", [&] { maq::read_bundle(cut.buffers()); });
  missing.contents.erase("box_head.onnx");
  expect_error(MAQ_ERROR_BAD_BUNDLE, "memory:box_head.onnx is missing", [&] { maq::read_bundle(missing.buffers()); });
  outside.contents["manifest.json"] = "{";
  expect_error(MAQ_ERROR_BAD_BUNDLE, "memory:manifest.json is not a JSON object",
               [&] { maq::read_bundle(outside.buffers()); });
}

TEST(Bundle, FromMemoryNeedsAManifestAndEachNameOnce) {
  InMemory memory{BundleCopy()};
  std::vector<maq::NamedBuffer> twice = memory.buffers(), nameless = twice, empty = twice;
  twice.push_back(twice.back());
  expect_error(MAQ_ERROR_INVALID_ARGUMENT, "Two buffers of the bundle are named trunk.onnx",
               [&] { maq::read_bundle(twice); });
  nameless[1].name.clear();
  expect_error(MAQ_ERROR_INVALID_ARGUMENT, "has no name", [&] { maq::read_bundle(nameless); });
  empty[1].data = nullptr;
  expect_error(MAQ_ERROR_INVALID_ARGUMENT, "but its data is NULL", [&] { maq::read_bundle(empty); });
  memory.contents.erase("manifest.json");
  expect_error(MAQ_ERROR_NOT_FOUND, "None of the 7 buffers", [&] { maq::read_bundle(memory.buffers()); });
  expect_error(MAQ_ERROR_NOT_FOUND, "manifest.json", [] { maq::read_bundle(std::vector<maq::NamedBuffer>()); });
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

TEST(Bundle, ARuntimeLibraryThatIsTooOldIsNamedWithItsVersion) {
  expect_error(MAQ_ERROR_RUNTIME_LIBRARY, "is ONNX Runtime 1.9.0, but 1.20.0 or newer is needed",
               [] { maq::OnnxRuntimeLibrary(MAQ_TEST_OLD_ONNXRUNTIME, maq::Log()); });
}

TEST(Bundle, TelemetryIsOffBeforeTheLibraryIsOpened) {
  unsetenv("ORT_DISABLE_TELEMETRY");
  const auto library = runtime();
  EXPECT_STREQ(std::getenv("ORT_DISABLE_TELEMETRY"), "1");
}

}  // namespace
