#include <dlfcn.h>

#include <cstring>

#include "core/build_info.h"
#include "core/error.h"
#include "core/own_folder.h"
#include "image/file_decoders.h"

namespace maq {
namespace {

constexpr char kFileName[] = "libmaquette_files.so";

const FileDecoders* open_library() {
  const std::string path = own_folder() + "maquette/" + kFileName;
  // Never closed again: the libraries below it do not survive unloading.
  void* library = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (library == nullptr) {
    throw Error(MAQ_ERROR_RUNTIME_LIBRARY, "Image and video files need ", path, ", which cannot be opened: ", dlerror(),
                ". Install it and OpenCV's imgcodecs and videoio beside libmaquette.so.");
  }
  const auto get_export = reinterpret_cast<FileDecodersExport (*)()>(dlsym(library, kFileDecodersSymbol));
  const FileDecodersExport found = get_export == nullptr ? FileDecodersExport{"", nullptr} : get_export();
  if (found.decoders == nullptr || std::strcmp(found.version, sdk_version()) != 0) {
    throw Error(MAQ_ERROR_RUNTIME_LIBRARY, path, " is of version '", found.version, "', but this SDK is ",
                sdk_version(), ": install both from the same build.");
  }
  return found.decoders;
}

}  // namespace

const FileDecoders& file_decoders() {
  static const FileDecoders* const decoders = open_library();  // tried again when it throws
  return *decoders;
}

}  // namespace maq
