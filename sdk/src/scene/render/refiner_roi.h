// The refiner's region of interest: the part of an image that it must compute.
#pragma once

#include "scene/render/descriptor_raster.h"

namespace maq {

// Radius of every refiner's receptive field: five scales, three 3x3 convolutions at the coarsest of 16 pixels and at
// most four at each of the others reach 1 + 2 + 4 + 8 + 16 times that; and where a pixel is in one of 16.
inline constexpr int kReceptiveFieldRadius_px = 96;

// The part of a frame (sides multiples of 16) that holds `occupied`, which has points, and the receptive field around
// it: outside, the refiner's output does not depend on any point. Its sides are 1/4, 1/2, 3/4 or all of the frame's,
// since a session is prepared for every size; the whole frame unless a quarter of the pixels is saved.
RasterWindow window_to_refine(const RasterWindow& occupied, int width_px, int height_px);

}  // namespace maq
