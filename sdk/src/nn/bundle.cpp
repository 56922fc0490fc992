#include "nn/bundle.h"

#include <algorithm>
#include <filesystem>
#include <functional>
#include <iterator>
#include <optional>

#include "core/error.h"
#include "core/files/file.h"
#include "nn/sha256.h"

namespace maq {
namespace {

using Bytes = std::vector<uint8_t>;
// The bytes of a file of that name; nothing where there is none. `listed` is null for the manifest itself.
using FileReading = std::function<std::optional<Bytes>(const std::string& name, const FileSpec* listed)>;

constexpr char kManifest[] = "manifest.json";
constexpr uint64_t kMaxManifestBytes = 1 << 24;
constexpr uint64_t kMaxModelBytes = uint64_t(1) << 31;  // protobuf ends there
constexpr char kRemedy[] = "Fetch or export the bundle again.";

// Whether an ONNX file keeps weights in other files, which the manifest would not cover. Such a tensor has an entry
// with the key "location": field 1 of a protobuf message, 8 bytes long.
bool refers_to_other_files(const Bytes& onnx) {
  constexpr uint8_t kEntry[] = {0x0a, 8, 'l', 'o', 'c', 'a', 't', 'i', 'o', 'n'};
  return std::search(onnx.begin(), onnx.end(), std::begin(kEntry), std::end(kEntry)) != onnx.end();
}

void check_size(uint64_t size_bytes, const FileSpec& spec, const std::string& path) {
  if (size_bytes == uint64_t(spec.bytes)) return;
  throw Error(MAQ_ERROR_BAD_BUNDLE, path, " has ", size_bytes, " bytes, but the manifest says ", spec.bytes,
              ": it is incomplete or was changed. ", kRemedy);
}

void verify(const Bytes& bytes, const FileSpec& spec, const std::string& path) {
  check_size(bytes.size(), spec, path);
  if (const std::string digest = sha256_hex(bytes.data(), bytes.size()); digest != spec.sha256) {
    throw Error(MAQ_ERROR_BAD_BUNDLE, path, " has SHA-256 ", digest.substr(0, 12), "…, but the manifest says ",
                spec.sha256.substr(0, 12), "…: it is damaged or was changed. ", kRemedy);
  }
  if (refers_to_other_files(bytes)) {
    throw Error(
        MAQ_ERROR_BAD_BUNDLE, path,
        " keeps weights in another file, which the manifest cannot vouch for. Export the bundle with all weights "
        "inside.");
  }
}

Bundle read_verified(const std::string& prefix, const Bytes& manifest, const FileReading& read) {
  Bundle bundle{prefix, parse_manifest(std::string(manifest.begin(), manifest.end()), prefix + kManifest), {}};
  for (const auto& [name, spec] : bundle.manifest.files) {
    std::optional<Bytes> bytes = read(name, &spec);
    if (!bytes) {
      throw Error(MAQ_ERROR_BAD_BUNDLE, bundle.path_of(name), " is missing, but the manifest lists it. ", kRemedy);
    }
    verify(*bytes, spec, bundle.path_of(name));
    bundle.files[name] = std::move(*bytes);
  }
  return bundle;
}

}  // namespace

Bundle read_bundle(const std::string& folder) {
  if (!is_folder(folder)) {
    throw Error(MAQ_ERROR_NOT_FOUND, "Model bundle ", folder,
                " is not a folder; give the folder that holds manifest.json and the .onnx files.");
  }
  const FileReading read = [&](const std::string& name, const FileSpec* listed) -> std::optional<Bytes> {
    const std::string path = folder + "/" + name;
    if (!file_exists(path)) return std::nullopt;
    if (listed == nullptr) return read_file(path, kMaxManifestBytes);
    // A file of another size is not even read.
    std::error_code is_no_file;
    const uintmax_t size_bytes = std::filesystem::file_size(std::filesystem::u8path(path), is_no_file);
    if (!is_no_file) check_size(size_bytes, *listed, path);
    return read_file(path, std::min(uint64_t(listed->bytes), kMaxModelBytes));
  };
  const std::optional<Bytes> manifest = read(kManifest, nullptr);
  if (!manifest) {
    throw Error(MAQ_ERROR_NOT_FOUND, folder, " has no manifest.json, so it is not a model bundle; check the path.");
  }
  return read_verified(folder + "/", *manifest, read);
}

Bundle read_bundle(const std::vector<NamedBuffer>& buffers) {
  for (const NamedBuffer& buffer : buffers) {
    if (buffer.name.empty()) throw Error(MAQ_ERROR_INVALID_ARGUMENT, "A buffer of the bundle has no name.");
    if (buffer.data == nullptr && buffer.size_bytes > 0) {
      throw Error(MAQ_ERROR_INVALID_ARGUMENT, "Buffer ", buffer.name, " of the bundle has ", buffer.size_bytes,
                  " bytes, but its data is NULL.");
    }
    const auto is_of_that_name = [&](const NamedBuffer& other) { return other.name == buffer.name; };
    if (std::count_if(buffers.begin(), buffers.end(), is_of_that_name) > 1) {
      throw Error(MAQ_ERROR_INVALID_ARGUMENT, "Two buffers of the bundle are named ", buffer.name,
                  "; give each file once.");
    }
  }
  const FileReading read = [&](const std::string& name, const FileSpec*) -> std::optional<Bytes> {
    const auto found =
        std::find_if(buffers.begin(), buffers.end(), [&](const NamedBuffer& buffer) { return buffer.name == name; });
    if (found == buffers.end()) return std::nullopt;
    const auto* bytes = static_cast<const uint8_t*>(found->data);
    return Bytes(bytes, bytes + found->size_bytes);
  };
  const std::optional<Bytes> manifest = read(kManifest, nullptr);
  if (!manifest) {
    throw Error(MAQ_ERROR_NOT_FOUND, "None of the ", buffers.size(),
                " buffers of the bundle is named manifest.json; give the manifest and each file that it lists.");
  }
  return read_verified("memory:", *manifest, read);
}

}  // namespace maq
