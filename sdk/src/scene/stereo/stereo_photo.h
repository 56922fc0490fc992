// A photo for stereo: grey, without distortion, with its camera.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "image/geometry/pinhole_camera.h"

namespace maq {

struct StereoPhoto {
  PinholeCamera camera;
  std::vector<uint8_t> grey;   // row by row
  std::vector<uint8_t> valid;  // 0: depth is not wanted there; empty: it is everywhere

  size_t pixels() const { return size_t(camera.width_px) * size_t(camera.height_px); }
};

// From pixels of one camera to pixels of another: (x, y, 1) at depth z is at turn (x, y, 1) + shift / z, both times z
// in the other camera; the third number is the depth there.
struct PixelTransfer {
  PixelTransfer(const PinholeCamera& from, const PinholeCamera& to);

  double turn[9];
  double shift[3];
};

}  // namespace maq
