// Gravity-aligned frames, in which the world's up is up (NPBG++, arXiv 2203.13318, section 3.2): photos are rotated
// into them for the extractor, images are rendered in them and rotated back.
#pragma once

#include <array>

#include "image/geometry/pinhole_camera.h"
#include "image/geometry/warp.h"

namespace maq {

// The camera rotated about its optical axis so that `up` of the world points up in the image. As it is where the
// world's up is along the optical axis, and continuous near that.
PinholeCamera gravity_aligned(const PinholeCamera& camera, const std::array<double, 3>& up);

// The camera rotated about its axis until up is up, with the smallest frame that holds its whole image and has sides
// that are multiples of `multiple`. Throws MAQ_ERROR_INVALID_ARGUMENT where that is a million pixels away from the
// first one.
PinholeCamera gravity_aligned_frame(const PinholeCamera& camera, const std::array<double, 3>& up, int multiple);

// From `source` to `target`, two cameras that differ by their frames and a rotation about the axis.
PixelMap pixel_map_between(const PinholeCamera& source, const PinholeCamera& target);

}  // namespace maq
