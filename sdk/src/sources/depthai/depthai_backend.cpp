#include "sources/depthai/depthai_backend.h"

#include <unistd.h>

#include <cstdlib>

#include "core/error.h"
#include "core/module.h"
#include "sources/control_options.h"
#include "sources/depthai/depthai_camera.h"

namespace maq {
namespace {

constexpr char kFile[] = "libmaquette_depthai.so";

DepthAiDriver* open_driver() {
  // Unless it is told not to before it loads, the vendor's library prints, and newer versions of it report usage over
  // the network.
  setenv("DEPTHAI_LEVEL", "off", 0);
  setenv("DEPTHAI_TELEMETRY", "0", 0);
  return static_cast<DepthAiDriver*>(open_module(
      kFile, kDepthAiSymbol, "DepthAI cameras need",
      "Build it with -DMAQ_WITH_DEPTHAI=ON (docs/reference/cameras/depthai.md) and install it beside libmaquette.so."));
}

DepthAiDriver& driver() {
  static DepthAiDriver* const opened = open_driver();  // tried again when it throws
  return *opened;
}

}  // namespace

CameraOpener depthai_uri_opener(SourceUri uri, int buffers, const Log& log) {
  DepthAiRequest request{uri.width_px, uri.height_px, uri.fps, {}};
  const int64_t depth = uri.take_integer("depth", -1, 0, 1);
  if (depth >= 0) request.depth = depth == 1;
  uri.expect_no_more_options(std::string("size, fps, depth, ") + kControlOptions);
  return depthai_opener(driver(), uri.target, request, buffers, log);
}

std::vector<CameraListing> list_depthai_cameras() {
  if (access(module_path(kFile).c_str(), F_OK) != 0) return {};
  try {
    return list_depthai_cameras(driver());
  } catch (const Error& error) {
    CameraListing broken;
    broken.uri = "depthai:";
    broken.status = error.status();
    broken.problem = error.what();
    return {broken};
  }
}

}  // namespace maq
