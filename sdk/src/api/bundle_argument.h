// The model bundle that a config names.
#pragma once

#include <cstdint>
#include <functional>

#include "maquette/types.h"
#include "nn/bundle.h"

namespace maq {

// Reads the bundle in folder `path`; without one of `files`, which are copied, so that it may be read later; without
// these the bundle `installed` of the folder share/maquette/models beside the library. Throws ArgumentError for a path
// and files, or files without content; the reader throws what read_bundle throws.
std::function<Bundle()> bundle_reader(const char* path, const maq_memory_file* files, uint32_t file_count,
                                      const char* installed);

template <class Config>
std::function<Bundle()> bundle_reader(const Config& config, const char* installed) {
  return bundle_reader(config.bundle_path, config.bundle_files, config.bundle_file_count, installed);
}

}  // namespace maq
