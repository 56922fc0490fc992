// Converts structs of the C API for scenes to structs of the engine.
#pragma once

#include <algorithm>
#include <cmath>
#include <iterator>
#include <memory>
#include <string>

#include "api/boundary.h"
#include "api/bundle_argument.h"
#include "api/camera_argument.h"
#include "api/model_options.h"
#include "api/scene/scene_handles.h"
#include "core/worker_threads.h"
#include "image/geometry/lens.h"
#include "nn/provider.h"
#include "scene/networks/scene_networks.h"

namespace maq {

// The bundle of configs that name none.
inline constexpr char kSceneBundle[] = "scenes-int8";

// Throws ArgumentError for options out of range.
inline SessionSettings scene_session_settings(const maq_model_options& model) {
  require_model_options("config.model", model, ThreadMeasuring::kUnsupported);
  SessionSettings settings;
  settings.threads = model.threads > 0 ? model.threads : default_threads();
  settings.provider = model.provider;
  return settings;
}

inline std::shared_ptr<SceneNetworks> open_scene_networks(maq_context* context, Bundle bundle,
                                                          SessionSettings settings) {
  const auto runtime = context->state->onnxruntime();
  settings.provider = available_provider(*runtime, settings.provider);
  return std::make_shared<SceneNetworks>(runtime, std::move(bundle), settings);
}

inline void check_distortion(const maq_intrinsics& given) {
  for (size_t i = 0; i < std::size(given.distortion); ++i) {
    if (!std::isfinite(given.distortion[i])) {
      throw ArgumentError("camera.intrinsics.distortion[", i, "] is ", given.distortion[i], ", but must be finite.");
    }
  }
}

// The lens with its distortion.
inline Lens lens_of(const maq_intrinsics& given) {
  Lens lens;
  lens.intrinsics() = intrinsics_of(given);
  if (is_distorted(given)) {
    lens.distortion = Distortion::kRational;
    std::copy_n(given.distortion, lens.coefficients.size(), lens.coefficients.begin());
  }
  return lens;
}

}  // namespace maq
