// Converts structs of the C API for scenes to structs of the engine.
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
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
#include "scene/point_cloud.h"

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

// Nothing for an app without one. The callback gets the finished fraction and a sentence, and returns false to cancel.
inline std::function<bool(double, const std::string&)> progress_of(maq_progress_callback callback, void* user_data) {
  if (callback == nullptr) return {};
  return [callback, user_data](double done, const std::string& stage) {
    return call_app("config.progress_callback", [&] { return callback(user_data, done, stage.c_str()); }) != 0;
  };
}

// The app's points. Those that are not finite stay so.
inline PointCloud points_of_app(const char* name, const maq_point_cloud& given) {
  require_struct_size(name, given.struct_size, sizeof(maq_point_cloud));
  if (given.point_count > 0) require_argument(given.xyz, (std::string(name) + ".xyz").c_str());
  if (given.point_count > kMaxPoints) {
    throw Error(MAQ_ERROR_UNSUPPORTED, "The cloud has ", given.point_count, " points, over the limit of ", kMaxPoints,
                "; make it thinner.");
  }
  PointCloud points;
  std::copy_n(given.origin, 3, points.origin.begin());
  points.reserve(given.point_count, false);
  for (uint64_t i = 0; i < given.point_count; ++i) {
    points.x.push_back(given.xyz[3 * i]);
    points.y.push_back(given.xyz[3 * i + 1]);
    points.z.push_back(given.xyz[3 * i + 2]);
  }
  return points;
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
