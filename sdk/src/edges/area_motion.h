// Whether something moved in an area of a depth frame since an earlier frame, told from the sensor's noise.
//
// Differences of inverse depth that a plane explains are motion; what is left of them is noise, which is thus measured
// where it is needed.
#pragma once

#include <cstdint>

namespace maq {

struct PixelArea {
  int left, top, right, bottom;
};

struct AreaMotion {
  bool moved = true;  // or too little is known to tell
  double shift = 0;   // of the surface, root mean square of what a plane explains, 1 / metres
  float jump = 0;     // difference of inverse depth beyond which a pixel has changed by itself, 1 / metres
};

// `metres`: depth of this frame, `inverse`: inverse depth of the earlier one, rows of `width_px` values; 0 in either:
// unknown.
AreaMotion motion_of(const float* metres, const float* inverse, int width_px, const PixelArea& area);

}  // namespace maq
