// depthai: URIs, and which there are.
#pragma once

#include <vector>

#include "core/log.h"
#include "sources/camera_backend.h"
#include "sources/uri.h"

namespace maq {

// For "depthai:" or "depthai:<id or address>", with size and fps as wishes, and depth. Throws for options that are none,
// and MAQ_ERROR_RUNTIME_LIBRARY in builds without DepthAI.
CameraOpener depthai_camera_opener(SourceUri uri, int buffers, const Log& log);

// None, too, in builds without DepthAI.
std::vector<CameraListing> list_depthai_sources();

}  // namespace maq
