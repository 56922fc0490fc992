#include "sources/v4l2_source.h"

#include "sources/control_options.h"
#include "sources/live_source.h"
#include "sources/v4l2_camera.h"

namespace maq {

std::unique_ptr<Source> open_v4l2_source(SourceUri uri, const SourceSettings& settings) {
  CameraWish wish{uri.take_text("format"), uri.width_px, uri.height_px, uri.fps};
  std::vector<ControlSetting> controls = take_control_options(uri);
  uri.expect_no_more_options(std::string("size, fps, format, ") + kControlOptions);
  // Those that the app holds, those that wait for it, one that is handed over and one that the device fills.
  const int buffers = settings.pool_size + settings.queue_length + 2;
  return std::make_unique<LiveSource>(v4l2_opener(SystemCalls::real(), uri.target, std::move(wish), buffers),
                                      uri.target, settings, std::move(controls));
}

}  // namespace maq
