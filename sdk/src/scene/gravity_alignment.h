// Frames in which the world's up is up: photos are turned into them before the extractor sees them, pictures are rendered in
// them and turned back (NPBG++, section 3.2).
#pragma once

#include <array>

#include "image/geometry/warp.h"
#include "scene/pinhole_camera.h"

namespace maq {

// The camera turned upright, with the smallest frame that holds its whole picture and has sides that are multiples of
// `multiple`. Throws MAQ_ERROR_INVALID_ARGUMENT where that is a million pixels away from the first one.
PinholeCamera upright_frame(const PinholeCamera& camera, const std::array<double, 3>& up, int multiple);

// From `source` to `target`, two cameras that differ by their frames and a turn about the axis.
PixelMap pixels_between(const PinholeCamera& source, const PinholeCamera& target);

}  // namespace maq
