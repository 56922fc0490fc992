// What the functions of the C API for scenes have in common.
#pragma once

#include <algorithm>
#include <cmath>
#include <iterator>
#include <memory>
#include <string>

#include "api/boundary.h"
#include "core/worker_threads.h"
#include "image/geometry/lens.h"
#include "scene/networks/scene_networks.h"
#include "scene/pinhole_camera.h"

namespace maq {

inline int scene_threads(int32_t wanted) {
  require_range("config.threads", wanted, 0, kMaxThreads);
  return wanted > 0 ? wanted : default_threads();
}

inline std::shared_ptr<SceneNetworks> open_scene_networks(maq_context* context, const char* folder, int threads,
                                                          bool spin) {
  SessionSettings settings;
  settings.threads = threads;
  settings.spin = spin;
  return std::make_shared<SceneNetworks>(context->state->onnxruntime(), read_bundle(folder), settings);
}

inline Intrinsics intrinsics_of(const maq_pinhole_camera& camera) {
  return {camera.width_px, camera.height_px, camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px};
}

// The camera without its distortion.
inline PinholeCamera pinhole_of(const maq_pinhole_camera& given) {
  PinholeCamera camera;
  camera.intrinsics() = intrinsics_of(given);
  std::copy_n(given.rotation, 9, camera.rotation.begin());
  std::copy_n(given.centre, 3, camera.centre.begin());
  return camera;
}

inline maq_pinhole_camera camera_of(const PinholeCamera& camera) {
  maq_pinhole_camera filled{};
  filled.struct_size = sizeof filled;
  filled.width_px = camera.width_px;
  filled.height_px = camera.height_px;
  filled.fx_px = camera.fx_px;
  filled.fy_px = camera.fy_px;
  filled.cx_px = camera.cx_px;
  filled.cy_px = camera.cy_px;
  std::copy_n(camera.rotation.begin(), 9, filled.rotation);
  std::copy_n(camera.centre.begin(), 3, filled.centre);
  return filled;
}

inline bool is_distorted(const maq_pinhole_camera& camera) {
  return std::any_of(std::begin(camera.distortion), std::end(camera.distortion), [](double k) { return k != 0; });
}

inline void check_distortion(const maq_pinhole_camera& camera) {
  for (size_t i = 0; i < std::size(camera.distortion); ++i) {
    if (!std::isfinite(camera.distortion[i])) {
      throw ArgumentError("camera.distortion[", i, "] is ", camera.distortion[i], ", but must be finite.");
    }
  }
}

// How it maps directions into its picture.
inline Lens lens_of(const maq_pinhole_camera& camera) {
  Lens lens;
  lens.intrinsics() = intrinsics_of(camera);
  if (is_distorted(camera)) {
    lens.distortion = Distortion::kRational;
    std::copy_n(camera.distortion, lens.coefficients.size(), lens.coefficients.begin());
  }
  return lens;
}

}  // namespace maq
