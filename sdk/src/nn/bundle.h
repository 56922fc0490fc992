// A model bundle: a manifest and the files it lists, from a folder or from memory, read and verified as a whole.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "nn/manifest.h"

namespace maq {

struct Bundle {
  std::string prefix;  // prefix of file names in errors: "<folder>/", or "memory:"
  Manifest manifest;
  // The very bytes that were verified, by file name; networks are made from them and not from the disk again.
  std::map<std::string, std::vector<uint8_t>> files;

  // A listed file as errors name it.
  std::string path_of(const std::string& file) const { return prefix + file; }
};

// A file of a bundle that lies in memory of the caller.
struct NamedBuffer {
  std::string name;  // as in the folder: "manifest.json", "trunk.onnx"
  const void* data = nullptr;
  size_t size_bytes = 0;
};

// Throws MAQ_ERROR_NOT_FOUND when the folder or its manifest is not there, MAQ_ERROR_UNSUPPORTED for another format
// version, and MAQ_ERROR_BAD_BUNDLE when a file is missing, its size or SHA-256 is not the manifest's, or it keeps
// weights in another file. Files that the manifest does not list are not read.
Bundle read_bundle(const std::string& folder);

// Reads buffers in any order and copies them. Throws MAQ_ERROR_INVALID_ARGUMENT for a buffer without a name or data,
// and for two of one name; MAQ_ERROR_NOT_FOUND if none is "manifest.json", and the errors of reading a folder.
Bundle read_bundle(const std::vector<NamedBuffer>& buffers);

}  // namespace maq
