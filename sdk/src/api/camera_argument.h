// Converts cameras of the C API to cameras of the engine, and back.
#pragma once

#include <algorithm>
#include <iterator>

#include "api/boundary.h"
#include "image/geometry/pinhole_camera.h"
#include "maquette/pinhole_camera.h"

namespace maq {

inline bool is_distorted(const maq_intrinsics& given) {
  return std::any_of(std::begin(given.distortion), std::end(given.distortion), [](double k) { return k != 0; });
}

// The camera without its distortion.
inline PinholeCamera pinhole_of(const maq_pinhole_camera& given) {
  PinholeCamera camera;
  camera.intrinsics() = intrinsics_of(given.intrinsics);
  std::copy_n(given.rotation, 9, camera.rotation.begin());
  std::copy_n(given.centre, 3, camera.centre.begin());
  return camera;
}

// For an image to render. Throws MAQ_ERROR_INVALID_ARGUMENT for a camera with distortion.
inline PinholeCamera undistorted_pinhole_of(const maq_pinhole_camera& given) {
  require_struct_size("camera", given.struct_size, sizeof(maq_pinhole_camera));
  if (is_distorted(given.intrinsics)) {
    throw ArgumentError("camera.intrinsics.distortion is not 0; images are rendered without distortion.");
  }
  return pinhole_of(given);
}

inline maq_pinhole_camera camera_of(const PinholeCamera& camera) {
  maq_pinhole_camera filled{};
  filled.struct_size = sizeof filled;
  filled.intrinsics = {camera.width_px, camera.height_px, camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px, {}};
  std::copy_n(camera.rotation.begin(), 9, filled.rotation);
  std::copy_n(camera.centre.begin(), 3, filled.centre);
  return filled;
}

}  // namespace maq
