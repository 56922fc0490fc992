#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <optional>

#include "api/boundary.h"
#include "api/frame_handle.h"
#include "api/scene/scene_conversions.h"
#include "scene/assembly/build_scene.h"
#include "scene/splats/splat_discs.h"
#include "scene/splats/splat_fit.h"
#include "scene/splats/splat_holes.h"

using namespace maq;

namespace {

// A checked config.
struct BuildSettings {
  SessionSettings session;
  SceneBuildOptions options;
  BuildProgress progress;
};

maq_scene_build_config default_scene_build_config() {
  maq_scene_build_config config{};
  config.struct_size = sizeof config;
  return config;
}

CoefficientFormat coefficient_format(int32_t bits) {
  switch (bits) {
    case 0:
    case 8: return CoefficientFormat::kInt8;
    case 16: return CoefficientFormat::kInt16;
    case 32: return CoefficientFormat::kFloat32;
    default: throw ArgumentError("config.coefficient_bits is ", bits, ", but must be 8, 16 or 32, or 0 for 8.");
  }
}

// Nothing for the default.
std::optional<float> min_view_dependence(double variation) {
  if (variation == 0) return std::nullopt;
  if (variation == MAQ_SCENE_VARIATION_ALL) return 0.0f;
  if (!(variation > 0)) {
    throw ArgumentError("config.min_variation is ", variation,
                        ", but must be positive, 0 for the default, or MAQ_SCENE_VARIATION_ALL.");
  }
  // Colours are 0 to 1; a larger value would not fit into a float.
  constexpr double kMaxVariation = 1e30;
  return float(std::min(variation, kMaxVariation));
}

BuildSettings checked_settings(const maq_scene_build_config& config) {
  BuildSettings settings;
  settings.session = scene_session_settings(config.model);
  SceneBuildOptions& options = settings.options;
  if (config.long_side_px == MAQ_SCENE_LONG_SIDE_FULL) {
    options.long_side_px = 0;
  } else if (config.long_side_px != 0) {
    require_range("config.long_side_px", config.long_side_px, 1, MAQ_MAX_SIDE_PX);
    options.long_side_px = config.long_side_px;
  }
  options.packing = packing_of(coefficient_format(config.coefficient_bits), min_view_dependence(config.min_variation));
  if (config.visibility_scale != 0) options.fitting.visibility_scale = config.visibility_scale;
  options.fitting.near = config.near_depth;
  options.fitting.threads = settings.session.threads;
  if (config.max_memory_bytes != 0) options.fitting.max_bytes = config.max_memory_bytes;
  options.max_points = config.max_points;
  options.max_views = config.max_views;
  require_range("config.use_held_out", config.use_held_out, 0, 1);
  options.uses_held_out = config.use_held_out == 1;
  const int32_t points = number_in(config.points);
  require_range("config.points", points, int32_t(MAQ_SCENE_POINTS_DEFAULT), int32_t(MAQ_SCENE_POINTS_DEPTH));
  options.points = PointSource(points);
  require_range("config.splat_fit_s", config.splat_fit_s, 0.0, 86400.0);
  settings.progress = progress_of(config.progress_callback, config.progress_user_data);
  return settings;
}

maq_scene_build_stats stats_of(const SceneBuildStats& from) {
  maq_scene_build_stats stats{};
  stats.view_count = uint32_t(from.views);
  stats.unused_view_count = uint32_t(from.unused_views);
  stats.cloud_point_count = from.cloud_points;
  stats.seen_point_count = from.seen_points;
  stats.load_ms = from.load_ms;
  stats.visibility_ms = from.fitting.visibility_ms;
  stats.align_ms = from.fitting.align_ms;
  stats.extract_ms = from.fitting.extract_ms;
  stats.accumulate_ms = from.fitting.accumulate_ms;
  stats.solve_ms = from.fitting.solve_ms;
  stats.pack_ms = from.pack_ms;
  stats.depth_ms = from.depth_ms;
  return stats;
}

// Nothing without a callback. `end`: the part of the whole work at the end of this one.
BuildProgress part_of(const BuildProgress& whole, double end) {
  if (!whole) return {};
  return [=](double done, const std::string& stage) { return whole(end * done, stage); };
}

// Nothing if the callback cancelled.
std::optional<Splats> fitted_splats(const Scene& scene, const Capture& capture, const BuildSettings& settings,
                                    double seconds) {
  SplatFitOptions options;
  options.seconds = seconds;
  options.threads = settings.session.threads;
  bool is_cancelled = false;
  const auto progress = [&](double done, const std::string& stage) {
    is_cancelled = settings.progress && !settings.progress(0.2 + 0.8 * done, stage);
    return !is_cancelled;
  };
  WorkerThreads threads(options.threads);
  Splats splats = splats_of_points(scene, threads);
  const std::vector<FitPhoto> photos =
      photos_to_fit(capture, settings.options.long_side_px, settings.options.uses_held_out);
  fill_holes(splats, photos, options.threads);
  fit_splats(splats, photos, options, progress);
  if (is_cancelled) return std::nullopt;
  return splats;
}

// Unchanged if it has no length; the builder refuses it then.
std::array<double, 3> unit_vector(const double (&vector)[3]) {
  const double length = std::hypot(vector[0], vector[1], vector[2]);
  std::array<double, 3> unit = {vector[0], vector[1], vector[2]};
  if (length > 0 && std::isfinite(length)) {
    for (double& value : unit) value /= length;
  }
  return unit;
}

}  // namespace

struct maq_scene_builder : HandleOf<HandleKind::kSceneBuilder> {
  maq_scene_builder(BuildProgress wanted, PointCloud cloud, const std::array<double, 3>& up,
                    std::shared_ptr<SceneNetworks> networks, const SceneBuildOptions& options)
      : progress(std::move(wanted)), builder(std::move(cloud), up, std::move(networks), options) {}
  BuildProgress progress;
  SceneBuilder builder;
};

maq_status maq_scene_build_config_init(maq_scene_build_config* config, uint32_t struct_size) {
  return init_config(__func__, config, struct_size, default_scene_build_config());
}

maq_status maq_scene_build(maq_context* context, const maq_scene_build_config* given, const maq_capture* capture,
                           maq_scene** scene) {
  return guarded(context, __func__, [&] {
    require_argument(context, "context");
    require_argument(capture, "capture");
    require_argument(scene, "scene");
    const maq_scene_build_config config = read_config(given, "config", default_scene_build_config());
    const BuildSettings settings = checked_settings(config);
    const auto networks = open_scene_networks(context, read_bundle_argument(config.model, "config.model", kSceneBundle),
                                              settings.session);
    const double fit_s = config.splat_fit_s;
    std::optional<BuiltScene> built =
        build_scene(capture->capture, networks, settings.options, part_of(settings.progress, fit_s > 0 ? 0.2 : 1.0));
    if (!built) return keep_error(context, MAQ_CANCELLED, nullptr, "The progress callback cancelled the build.");
    if (fit_s > 0) {
      std::optional<Splats> splats = fitted_splats(built->scene, capture->capture, settings, fit_s);
      if (!splats) return keep_error(context, MAQ_CANCELLED, nullptr, "The progress callback cancelled the fit.");
      *scene = new maq_scene(std::move(*splats), stats_of(built->stats));
    } else {
      *scene = new maq_scene(std::move(built->scene), stats_of(built->stats));
    }
    return MAQ_OK;
  });
}

maq_status maq_scene_builder_create(maq_context* context, const maq_scene_build_config* given,
                                    const maq_point_cloud* cloud, maq_scene_builder** builder) {
  return guarded(context, __func__, [&] {
    require_argument(context, "context");
    require_argument(cloud, "cloud");
    require_argument(builder, "builder");
    const maq_scene_build_config config = read_config(given, "config", default_scene_build_config());
    BuildSettings settings = checked_settings(config);
    PointCloud points = points_of_app("cloud", *cloud);
    auto networks = open_scene_networks(context, read_bundle_argument(config.model, "config.model", kSceneBundle),
                                        settings.session);
    *builder = new maq_scene_builder(std::move(settings.progress), std::move(points), unit_vector(cloud->up),
                                     std::move(networks), settings.options);
    return MAQ_OK;
  });
}

void maq_scene_builder_destroy(maq_scene_builder* builder) { destroy(builder, "builder", __func__); }

maq_status maq_scene_builder_add_view(maq_scene_builder* builder, const maq_frame* photo,
                                      const maq_pinhole_camera* camera, uint64_t* seen_point_count) {
  return guarded_alone(builder, "builder", __func__, [&] {
    require_argument(photo, "photo");
    require_argument(camera, "camera");
    require_struct_size("camera", camera->struct_size, sizeof(maq_pinhole_camera));
    check_camera(pinhole_of(*camera), "The photo's camera");
    check_distortion(camera->intrinsics);
    const std::optional<size_t> seen = builder->builder.add_view(photo->frame.image, lens_of(camera->intrinsics),
                                                                 pinhole_of(*camera), builder->progress);
    if (!seen) return keep_error(builder, MAQ_CANCELLED, nullptr, "The photo was not added: the call was cancelled.");
    if (seen_point_count != nullptr) *seen_point_count = *seen;
    return MAQ_OK;
  });
}

maq_status maq_scene_builder_cancel(maq_scene_builder* builder) {
  return guarded(builder, __func__, [&] {
    require_argument(builder, "builder");
    builder->builder.cancel();
    return MAQ_OK;
  });
}

maq_status maq_scene_builder_get_stats(const maq_scene_builder* builder, maq_scene_build_stats* stats) {
  return guarded_alone(builder, "builder", __func__, [&] {
    write_struct(stats, "stats", stats_of(builder->builder.stats()));
    return MAQ_OK;
  });
}

maq_status maq_scene_builder_finish(maq_scene_builder* builder, maq_scene** scene) {
  return guarded_alone(builder, "builder", __func__, [&] {
    require_argument(scene, "scene");
    Scene made = builder->builder.finish();
    *scene = new maq_scene(std::move(made), stats_of(builder->builder.stats()));
    return MAQ_OK;
  });
}
