// A model bundle: a folder with a manifest and the files it lists, read and verified as a whole.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "nn/manifest.h"

namespace maq {

struct Bundle {
  std::string folder;
  Manifest manifest;
  // The very bytes that were verified, by file name; networks are made from them and not from the disk again.
  std::map<std::string, std::vector<uint8_t>> files;
};

// Throws MAQ_ERROR_NOT_FOUND when the folder or its manifest is not there, and MAQ_ERROR_BAD_BUNDLE when a file is
// missing, its size or SHA-256 is not the manifest's, or it keeps weights in another file.
Bundle read_bundle(const std::string& folder, BundleTask task = BundleTask::kDensePose);

}  // namespace maq
