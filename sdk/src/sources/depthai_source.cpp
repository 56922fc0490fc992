#include "sources/depthai_source.h"

#include "core/error.h"
#include "sources/depthai_camera.h"
#include "sources/depthai_library.h"
#include "sources/live_source.h"

namespace maq {

std::unique_ptr<Source> open_depthai_source(SourceUri uri, const SourceSettings& settings) {
  DepthAiWish wish{uri.width_px, uri.height_px, uri.fps, {}};
  const int64_t depth = uri.take_integer("depth", -1, 0, 1);
  if (depth >= 0) wish.depth = depth == 1;
  uri.expect_no_more_options("size, fps and depth");
  // Those that the app holds, those that wait for it, and one that is handed over.
  const int buffers = settings.pool_size + settings.queue_length + 1;
  const std::string name = uri.target.empty() ? "The DepthAI camera" : "DepthAI camera " + uri.target;
  return std::make_unique<LiveSource>(depthai_opener(depthai_driver(), uri.target, wish, buffers, settings.log), name,
                                      settings);
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
