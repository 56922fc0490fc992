#include "nn/bundle.h"

#include <algorithm>
#include <iterator>

#include "core/error.h"
#include "core/file.h"
#include "nn/sha256.h"

namespace maq {
namespace {

// Whether an ONNX file keeps weights in other files, which the manifest would not cover. Such a tensor has an entry with
// the key "location": field 1 of a protobuf message, 8 bytes long.
bool refers_to_other_files(const std::vector<uint8_t>& onnx) {
  constexpr uint8_t kEntry[] = {0x0a, 8, 'l', 'o', 'c', 'a', 't', 'i', 'o', 'n'};
  return std::search(onnx.begin(), onnx.end(), std::begin(kEntry), std::end(kEntry)) != onnx.end();
}

}  // namespace

Bundle read_bundle(const std::string& folder, BundleTask task) {
  if (!is_folder(folder)) {
    throw Error(MAQ_ERROR_NOT_FOUND, "Model bundle ", folder,
                " is not a folder; give the folder that holds manifest.json and the .onnx files.");
  }
  const std::string manifest_path = folder + "/manifest.json";
  if (!file_exists(manifest_path)) {
    throw Error(MAQ_ERROR_NOT_FOUND, folder, " has no manifest.json, so it is not a model bundle; check the path.");
  }
  const std::vector<uint8_t> text = read_file(manifest_path);

  Bundle bundle;
  bundle.folder = folder;
  bundle.manifest = parse_manifest(std::string(text.begin(), text.end()), manifest_path, task);
  for (const auto& [name, spec] : bundle.manifest.files) {
    const std::string path = folder + "/" + name;
    if (!file_exists(path)) {
      throw Error(MAQ_ERROR_BAD_BUNDLE, path,
                  " is missing, but the manifest lists it. Fetch or export the bundle again.");
    }
    std::vector<uint8_t> bytes = read_file(path);
    if (int64_t(bytes.size()) != spec.bytes) {
      throw Error(MAQ_ERROR_BAD_BUNDLE, path, " has ", bytes.size(), " bytes, but the manifest says ", spec.bytes,
                  ": it is incomplete or was changed. Fetch or export the bundle again.");
    }
    if (const std::string digest = sha256_hex(bytes.data(), bytes.size()); digest != spec.sha256) {
      throw Error(MAQ_ERROR_BAD_BUNDLE, path, " has SHA-256 ", digest.substr(0, 12), "…, but the manifest says ",
                  spec.sha256.substr(0, 12), "…: it is damaged or was changed. Fetch or export the bundle again.");
    }
    if (refers_to_other_files(bytes)) {
      throw Error(
          MAQ_ERROR_BAD_BUNDLE, path,
          " keeps weights in another file, which the manifest cannot vouch for. Export the bundle with all weights "
          "inside.");
    }
    bundle.files[name] = std::move(bytes);
  }
  return bundle;
}

}  // namespace maq
