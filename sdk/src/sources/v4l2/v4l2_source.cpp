#include "sources/v4l2/v4l2_source.h"

#include "sources/control_options.h"
#include "sources/v4l2/v4l2_camera.h"

namespace maq {

CameraOpener v4l2_camera_opener(SourceUri uri, int buffers, const Log&) {
  CameraWish wish{uri.take_text("format"), uri.width_px, uri.height_px, uri.fps};
  uri.expect_no_more_options(std::string("size, fps, format, ") + kControlOptions);
  return v4l2_opener(SystemCalls::real(), uri.target, std::move(wish), buffers);
}

}  // namespace maq
