// depthai: as a source.
#pragma once

#include <memory>
#include <vector>

#include "sources/source.h"
#include "sources/uri.h"

namespace maq {

// "depthai:" or "depthai:<id or address>", with size and fps as wishes, and depth. Throws what open_depthai_camera throws,
// and MAQ_ERROR_RUNTIME_LIBRARY in builds without DepthAI.
std::unique_ptr<Source> open_depthai_source(SourceUri uri, const SourceSettings& settings);

// None, too, in builds without DepthAI.
std::vector<CameraListing> list_depthai_sources();

}  // namespace maq
