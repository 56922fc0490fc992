#include "api/bundle_argument.h"

#include <memory>
#include <string>
#include <vector>

#include "api/boundary.h"
#include "core/module.h"

namespace maq {
namespace {

Bundle read_installed_bundle(const std::string& config, const std::string& name) {
  const std::string folder = concatenate("models/", name), manifest = find_shared_file(folder + "/manifest.json");
  if (!manifest.empty()) return read_bundle(find_shared_file(folder));
  throw Error(MAQ_ERROR_NOT_FOUND, config, ".bundle_path is NULL, but ", library_folder(), "../share/maquette/", folder,
              " does not exist; install the models with the library, or set bundle_path or bundle_files.");
}

// Names and addresses of the caller's files.
std::vector<NamedBuffer> buffers_of(const char* config, const char* path, const maq_memory_file* files,
                                    uint32_t file_count) {
  if (path != nullptr && file_count > 0) {
    throw ArgumentError(config, " has both bundle_path and bundle_files; set one.");
  }
  if (file_count > 0 && files == nullptr) throw ArgumentError(config, ".bundle_files is NULL.");
  std::vector<NamedBuffer> buffers;
  for (uint32_t i = 0; i < file_count; ++i) {
    if (files[i].name == nullptr || files[i].data == nullptr) {
      throw ArgumentError(config, ".bundle_files[", i, "] has no ", files[i].name == nullptr ? "name" : "data", ".");
    }
    buffers.push_back({files[i].name, files[i].data, files[i].size_bytes});
  }
  return buffers;
}

}  // namespace

Bundle read_bundle_argument(const char* config, const char* path, const maq_memory_file* files, uint32_t file_count,
                            const char* installed) {
  const std::vector<NamedBuffer> buffers = buffers_of(config, path, files, file_count);
  if (path != nullptr) return read_bundle(std::string(path));
  return buffers.empty() ? read_installed_bundle(config, installed) : read_bundle(buffers);
}

std::function<Bundle()> bundle_reader(const char* config, const char* path, const maq_memory_file* files,
                                      uint32_t file_count, const char* installed) {
  const std::vector<NamedBuffer> given = buffers_of(config, path, files, file_count);
  if (path != nullptr) return [folder = std::string(path)] { return read_bundle(folder); };
  if (given.empty()) {
    return [of = std::string(config), name = std::string(installed)] { return read_installed_bundle(of, name); };
  }
  struct File {
    std::string name;
    std::vector<uint8_t> bytes;
  };
  const auto copies = std::make_shared<std::vector<File>>();
  for (const NamedBuffer& buffer : given) {
    const auto* const bytes = static_cast<const uint8_t*>(buffer.data);
    copies->push_back({buffer.name, {bytes, bytes + buffer.size_bytes}});
  }
  return [copies] {
    std::vector<NamedBuffer> buffers;
    for (const File& file : *copies) buffers.push_back({file.name, file.bytes.data(), file.bytes.size()});
    return read_bundle(buffers);
  };
}

}  // namespace maq
