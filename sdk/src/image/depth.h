// Depth images to metres.
#pragma once

#include "core/frame.h"

namespace maq {

// Writes the depth of a DEPTH16 or DEPTH32F image in metres, width * height floats without padding, 0 where it is
// unknown: 0 and 65535 of 16 bits; NaN, infinite, 0, negative and denormal floats. `unit_m`: metres of a stored 1.
void depth_in_metres(const ImageView& depth, double unit_m, float* metres);

// Converts with the unit of the format.
inline void depth_in_metres(const ImageView& depth, float* metres) {
  depth_in_metres(depth, depth.format == MAQ_PIXEL_DEPTH16 ? 0.001 : 1, metres);
}

}  // namespace maq
