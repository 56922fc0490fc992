// Which part of a picture the refiner must work on.
#pragma once

#include "scene/render/descriptor_raster.h"

namespace maq {

// Beyond that many pixels no refiner sees: five scales, three 3x3 convolutions at the coarsest of 16 pixels and at most four at
// each of the others reach 1 + 2 + 4 + 8 + 16 times that; and where a pixel is in one of 16.
inline constexpr int kRefinerReach_px = 96;

// The part of a frame (sides multiples of 16) that holds all that the refiner sees of `occupied`, which has points; so that
// outside of it, and of what the refiner makes of nothing, nothing changes. Its sides are 1/4, 1/2, 3/4 or all of the frame's, since
// every size is a network prepared anew; the whole frame unless a quarter of the pixels is saved.
RasterWindow window_to_refine(const RasterWindow& occupied, int width_px, int height_px);

}  // namespace maq
