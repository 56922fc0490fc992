#include "sources/depthai_library.h"

#include <dlfcn.h>
#include <unistd.h>

#include <cstdlib>
#include <cstring>

#include "core/build_info.h"
#include "core/error.h"
#include "core/own_folder.h"

namespace maq {
namespace {

std::string library_path() { return own_folder() + "maquette/libmaquette_depthai.so"; }

DepthAiDriver* open_library() {
  // Unless it is told not to before it loads, the vendor's library prints, and newer versions of it report usage over
  // the network.
  setenv("DEPTHAI_LEVEL", "off", 0);
  setenv("DEPTHAI_TELEMETRY", "0", 0);
  const std::string path = library_path();
  // Never closed again: threads of the vendor's library may still run.
  void* library = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (library == nullptr) {
    throw Error(
        MAQ_ERROR_RUNTIME_LIBRARY, "DepthAI cameras need ", path, ", which cannot be opened: ", dlerror(),
        ". Build it with -DMAQ_WITH_DEPTHAI=ON (docs/cameras/depthai.md) and install it beside libmaquette.so.");
  }
  const auto get_export = reinterpret_cast<DepthAiExport (*)()>(dlsym(library, kDepthAiSymbol));
  const DepthAiExport found = get_export == nullptr ? DepthAiExport{"", nullptr} : get_export();
  if (found.driver == nullptr || std::strcmp(found.version, sdk_version()) != 0) {
    throw Error(MAQ_ERROR_RUNTIME_LIBRARY, path, " is of version '", found.version, "', but this SDK is ",
                sdk_version(), ": install both from the same build.");
  }
  return found.driver;
}

}  // namespace

DepthAiDriver& depthai_driver() {
  static DepthAiDriver* const driver = open_library();  // tried again when it throws
  return *driver;
}

bool has_depthai_library() { return access(library_path().c_str(), F_OK) == 0; }

}  // namespace maq
