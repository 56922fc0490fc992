// v4l2: URIs.
#pragma once

#include "core/log.h"
#include "sources/camera_backend.h"
#include "sources/uri.h"

namespace maq {

// For "v4l2:/dev/video0", with size, fps and format as wishes. Throws for options that are none.
CameraOpener v4l2_camera_opener(SourceUri uri, int buffers, const Log& log);

}  // namespace maq
