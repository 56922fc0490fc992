// The mapping from directions to pixels, in the convention of OpenCV: the centre of the top left pixel is (0, 0).
#pragma once

#include "maquette/frame.h"

namespace maq {

// The base of Lens, which adds distortion, and of PinholeCamera, which adds a pose.
struct Intrinsics {
  int width_px = 0;
  int height_px = 0;
  double fx_px = 0, fy_px = 0, cx_px = 0, cy_px = 0;

  Intrinsics& intrinsics() { return *this; }
  const Intrinsics& intrinsics() const { return *this; }
};

inline bool operator==(const Intrinsics& a, const Intrinsics& b) {
  return a.width_px == b.width_px && a.height_px == b.height_px && a.fx_px == b.fx_px && a.fy_px == b.fy_px &&
         a.cx_px == b.cx_px && a.cy_px == b.cy_px;
}

// Drops the distortion.
inline Intrinsics intrinsics_of(const maq_intrinsics& given) {
  return {given.width_px, given.height_px, given.fx_px, given.fy_px, given.cx_px, given.cy_px};
}

// Returns the lens or camera for a larger or smaller image with the same field of view.
template <class HasIntrinsics>
HasIntrinsics resized(const HasIntrinsics& from, int width_px, int height_px) {
  HasIntrinsics made = from;
  const double scale_x = double(width_px) / from.width_px, scale_y = double(height_px) / from.height_px;
  made.width_px = width_px;
  made.height_px = height_px;
  made.fx_px *= scale_x;
  made.fy_px *= scale_y;
  // The image's border, half a pixel outside of the first centre, keeps its place in the scene.
  made.cx_px = (from.cx_px + 0.5) * scale_x - 0.5;
  made.cy_px = (from.cy_px + 0.5) * scale_y - 0.5;
  return made;
}

}  // namespace maq
