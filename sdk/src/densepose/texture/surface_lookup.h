// From a point of the body surface to the pixel that shows it.
#pragma once

#include <cstdint>
#include <optional>

#include "densepose/surface/dense_decode.h"

namespace maq {

struct SurfacePixel {
  float x_px = 0, y_px = 0;  // (0, 0) is the corner of the image; the middle of the first pixel is (0.5, 0.5)
  float distance = 0;        // from the wanted point, in U and V: 0 to 1.42
};

// Returns the pixel of `person`, counted from 1, whose U and V are nearest to the wanted ones, among the pixels that
// show `part`; the middle of several that are equally near. Returns nothing if no pixel shows the part.
std::optional<SurfacePixel> find_surface_pixel(const DensePlanes& planes, uint8_t person, int part, float u, float v);

}  // namespace maq
