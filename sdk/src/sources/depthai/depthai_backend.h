// depthai: URIs, and the module libmaquette_depthai.so, which brings the vendor's library along.
#pragma once

#include <vector>

#include "core/log.h"
#include "sources/camera_backend.h"
#include "sources/uri.h"

namespace maq {

// For "depthai:" or "depthai:<id or address>", with size, fps and depth as requests. Throws for unknown options, and
// MAQ_ERROR_RUNTIME_LIBRARY where the module is missing, cannot be opened, or is of another build.
CameraOpener depthai_uri_opener(SourceUri uri, int buffers, const Log& log);

// The devices that are connected; empty where the module is not installed.
std::vector<CameraListing> list_depthai_cameras();

}  // namespace maq
