#include "sources/depthai/depthai_source.h"

#include "core/error.h"
#include "sources/control_options.h"
#include "sources/depthai/depthai_camera.h"
#include "sources/depthai/depthai_backend.h"

namespace maq {

CameraOpener depthai_camera_opener(SourceUri uri, int buffers, const Log& log) {
  DepthAiWish wish{uri.width_px, uri.height_px, uri.fps, {}};
  const int64_t depth = uri.take_integer("depth", -1, 0, 1);
  if (depth >= 0) wish.depth = depth == 1;
  uri.expect_no_more_options(std::string("size, fps, depth, ") + kControlOptions);
  return depthai_opener(depthai_driver(), uri.target, wish, buffers, log);
}

std::vector<CameraListing> list_depthai_sources() {
  if (!has_depthai_library()) return {};
  try {
    return list_depthai_cameras(depthai_driver());
  } catch (const Error& error) {
    CameraListing broken;
    broken.uri = "depthai:";
    broken.status = error.status();
    broken.problem = error.what();
    return {broken};
  }
}

}  // namespace maq
