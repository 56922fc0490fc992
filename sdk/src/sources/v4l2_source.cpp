#include "sources/v4l2_source.h"

#include "sources/live_source.h"
#include "sources/v4l2_camera.h"

namespace maq {

std::unique_ptr<Source> open_v4l2_source(SourceUri uri, const SourceSettings& settings) {
  uri.expect_no_more_options("size and fps");
  // Those that the app holds, those that wait for it, one that is handed over and one that the device fills.
  const int buffers = settings.pool_size + settings.queue_length + 2;
  const CameraWish wish{uri.width_px, uri.height_px, uri.fps};
  const auto open = [path = uri.target, wish, buffers] {
    return open_v4l2_camera(SystemCalls::real(), path, wish, buffers);
  };
  return std::make_unique<LiveSource>(open, uri.target, settings);
}

}  // namespace maq
