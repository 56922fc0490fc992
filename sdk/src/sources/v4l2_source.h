// v4l2: as a source.
#pragma once

#include <memory>

#include "sources/source.h"
#include "sources/uri.h"

namespace maq {

// "v4l2:/dev/video0", with size and fps as wishes. Throws what open_v4l2_camera throws.
std::unique_ptr<Source> open_v4l2_source(SourceUri uri, const SourceSettings& settings);

}  // namespace maq
