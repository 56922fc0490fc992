// Splats where photos show something and the scene has no points.
#pragma once

#include <vector>

#include "scene/splats/splat_fit.h"

namespace maq {

// Adds splats for the cells of 8 x 8 pixels of photos that splats do not cover: in the colour of the photo, at the
// depth of the farthest splats around the cell, or of most splats of the photo. Returns how many were added.
size_t fill_holes(Splats& splats, const std::vector<FitPhoto>& photos, int threads);

}  // namespace maq
