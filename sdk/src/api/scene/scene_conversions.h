// Structs of the C API for scenes as the SDK has them, and back.
#pragma once

#include <algorithm>
#include <cmath>
#include <iterator>
#include <memory>
#include <string>

#include "api/boundary.h"
#include "api/bundle_argument.h"
#include "api/camera_argument.h"
#include "api/scene/scene_handles.h"
#include "core/worker_threads.h"
#include "image/geometry/lens.h"
#include "nn/provider.h"
#include "scene/networks/scene_networks.h"

namespace maq {

inline int scene_threads(int32_t wanted) {
  require_range("config.threads", wanted, 0, kMaxThreads);
  return wanted > 0 ? wanted : default_threads();
}

// The bundle that a config without one means.
inline constexpr char kSceneBundle[] = "scenes-int8";

inline std::shared_ptr<SceneNetworks> open_scene_networks(maq_context* context, Bundle bundle, int threads, bool spin,
                                                          maq_provider provider = MAQ_PROVIDER_CPU) {
  SessionSettings settings;
  settings.threads = threads;
  settings.spin = spin;
  const auto runtime = context->state->onnxruntime();
  settings.provider = available_provider(*runtime, provider);
  return std::make_shared<SceneNetworks>(runtime, std::move(bundle), settings);
}

inline void check_distortion(const maq_intrinsics& given) {
  for (size_t i = 0; i < std::size(given.distortion); ++i) {
    if (!std::isfinite(given.distortion[i])) {
      throw ArgumentError("camera.intrinsics.distortion[", i, "] is ", given.distortion[i], ", but must be finite.");
    }
  }
}

// With the distortion.
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
