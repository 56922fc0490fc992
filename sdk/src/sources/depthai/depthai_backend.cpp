#include "sources/depthai/depthai_backend.h"

#include <unistd.h>

#include <cstdlib>

#include "core/module.h"

namespace maq {
namespace {

constexpr char kFile[] = "libmaquette_depthai.so";

DepthAiDriver* open_library() {
  // Unless it is told not to before it loads, the vendor's library prints, and newer versions of it report usage over
  // the network.
  setenv("DEPTHAI_LEVEL", "off", 0);
  setenv("DEPTHAI_TELEMETRY", "0", 0);
  return static_cast<DepthAiDriver*>(open_module(
      kFile, kDepthAiSymbol, "DepthAI cameras need",
      "Build it with -DMAQ_WITH_DEPTHAI=ON (docs/cameras/depthai.md) and install it beside libmaquette.so."));
}

}  // namespace

DepthAiDriver& depthai_driver() {
  static DepthAiDriver* const driver = open_library();  // tried again when it throws
  return *driver;
}

bool has_depthai_library() { return access(module_path(kFile).c_str(), F_OK) == 0; }

}  // namespace maq
