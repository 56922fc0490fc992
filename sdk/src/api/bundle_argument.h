// The model bundle that a config names.
#pragma once

#include <cstdint>
#include <functional>

#include "maquette/types.h"
#include "nn/bundle.h"

namespace maq {

// Reads the bundle in folder `path`; without one of `files`; without these the bundle `installed` of the folder
// share/maquette/models beside the library. `config` is the name of the config that has them. Throws ArgumentError for
// a path and files, or files without content, and the errors of read_bundle.
Bundle read_bundle_argument(const char* config, const char* path, const maq_memory_file* files, uint32_t file_count,
                            const char* installed);

template <class Config>
Bundle read_bundle_argument(const Config& config, const char* name, const char* installed) {
  return read_bundle_argument(name, config.bundle_path, config.bundle_files, config.bundle_file_count, installed);
}

inline Bundle read_bundle_argument(const maq_model_options& options, const char* name, const char* installed) {
  return read_bundle_argument(name, options.bundle_path, options.bundle_files, options.bundle_file_count, installed);
}

// The same for later, and more than once: `files` are copied. Throws ArgumentError; the reader throws the rest.
std::function<Bundle()> bundle_reader(const char* config, const char* path, const maq_memory_file* files,
                                      uint32_t file_count, const char* installed);

template <class Config>
std::function<Bundle()> bundle_reader(const Config& config, const char* name, const char* installed) {
  return bundle_reader(name, config.bundle_path, config.bundle_files, config.bundle_file_count, installed);
}

inline std::function<Bundle()> bundle_reader(const maq_model_options& options, const char* name,
                                             const char* installed) {
  return bundle_reader(name, options.bundle_path, options.bundle_files, options.bundle_file_count, installed);
}

}  // namespace maq
