// Images of real lenses as cameras without distortion would take them.
#pragma once

#include <cstdint>
#include <vector>

#include "core/frame.h"
#include "image/geometry/lens.h"

namespace maq {

// The BGR image `distorted`, taken with `lens`, as `undistorted` (a lens without distortion, of any size) shows it,
// into `frame`, bilinear. `valid` gets, row by row, 255 for each pixel that comes from inside of `distorted`, 0 for
// others, which are black. Throws MAQ_ERROR_INVALID_ARGUMENT unless `distorted` is BGR and of the lens' size.
void undistort(const ImageView& distorted, const Lens& lens, const Lens& undistorted, Frame& frame,
               std::vector<uint8_t>& valid);

}  // namespace maq
