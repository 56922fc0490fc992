// A photo turned, moved or scaled, as floats for a network.
#pragma once

#include <array>
#include <vector>

#include "core/frame.h"

namespace maq {

// `photo` (BGR) into `rgb` [height_px][width_px][3], in 0..1. `back` takes a pixel (x, y) of the result to the photo's
// (b[0] x + b[1] y + b[2], b[3] x + b[4] y + b[5]), where it is read bilinearly; beyond the border the last pixels are
// repeated. Coordinates are not rounded to parts of a pixel, as OpenCV's warpAffine did before its version 5: what the
// networks learnt from and what they see here is the same. Throws MAQ_ERROR_INVALID_ARGUMENT unless `photo` is BGR.
void turn_photo(const ImageView& photo, const std::array<double, 6>& back, int width_px, int height_px,
                std::vector<float>& rgb);

}  // namespace maq
