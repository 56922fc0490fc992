#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <memory>
#include <optional>

#include "api/boundary.h"
#include "api/frame_handle.h"
#include "api/scene/scene_conversions.h"
#include "scene/assembly/build_scene.h"

using namespace maq;

namespace {

// A config that was checked.
struct BuildSettings {
  std::function<Bundle()> read_bundle;
  SceneBuildOptions options;
  BuildProgress progress;
};

maq_scene_build_config default_scene_build_config() {
  maq_scene_build_config config{};
  config.struct_size = sizeof config;
  config.long_side_px = 640;
  config.coefficient_bits = 8;
  config.min_variation = -1;
  config.visibility_scale = 1;
  return config;
}

BuildSettings checked_settings(const maq_scene_build_config& config) {
  BuildSettings settings;
  settings.read_bundle = bundle_reader(config, "config", kSceneBundle);
  SceneBuildOptions& options = settings.options;
  require_range("config.long_side_px", config.long_side_px, 0, MAQ_MAX_SIDE_PX);
  options.long_side_px = config.long_side_px;
  CoefficientFormat format = CoefficientFormat::kInt8;
  switch (config.coefficient_bits) {
    case 8: break;
    case 16: format = CoefficientFormat::kInt16; break;
    case 32: format = CoefficientFormat::kFloat32; break;
    default: throw ArgumentError("config.coefficient_bits is ", config.coefficient_bits, ", but must be 8, 16 or 32.");
  }
  if (std::isnan(config.min_variation)) throw ArgumentError("config.min_variation is not a number.");
  std::optional<float> min_view_dependence;
  // Colours are 0 to 1, and what is over this would not fit into a float.
  constexpr double kMaxVariation = 1e30;
  if (config.min_variation >= 0) min_view_dependence = float(std::min(config.min_variation, kMaxVariation));
  options.packing = packing_of(format, min_view_dependence);
  options.fitting.visibility_scale = config.visibility_scale;
  options.fitting.near = config.near_depth;
  options.fitting.threads = scene_threads(config.threads);
  if (config.max_memory_bytes != 0) options.fitting.max_bytes = config.max_memory_bytes;
  options.max_points = config.max_points;
  options.max_views = config.max_views;
  require_range("config.use_held_out", config.use_held_out, 0, 1);
  options.uses_held_out = config.use_held_out == 1;
  if (config.progress_callback != nullptr) {
    settings.progress = [callback = config.progress_callback, user_data = config.progress_user_data](
                            double done, const std::string& what) {
      return callback(user_data, done, what.c_str()) != 0;
    };
  }
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
  return stats;
}

// Unchanged where it has no length, which the builder refuses.
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
                           maq_scene_build_stats* stats, maq_scene** scene) {
  return guarded(context, __func__, [&] {
    require_argument(context, "context");
    require_argument(capture, "capture");
    require_argument(scene, "scene");
    const maq_scene_build_config config = read_config(given, "config", default_scene_build_config());
    const BuildSettings settings = checked_settings(config);
    if (stats != nullptr) require_struct_size("stats", stats->struct_size, sizeof *stats);
    const auto networks = open_scene_networks(context, settings.read_bundle(), settings.options.fitting.threads, true);
    std::optional<BuiltScene> built = build_scene(capture->capture, networks, settings.options, settings.progress);
    if (!built) return keep_error(context, MAQ_CANCELLED, nullptr, "The progress callback ended the building.");
    auto made = std::make_unique<maq_scene>(std::move(built->scene));
    if (stats != nullptr) write_struct(stats, "stats", stats_of(built->stats));
    *scene = made.release();
    return MAQ_OK;
  });
}

maq_status maq_scene_builder_create(maq_context* context, const maq_scene_build_config* given,
                                    const maq_point_cloud* cloud, maq_scene_builder** builder) {
  return guarded(context, __func__, [&] {
    require_argument(context, "context");
    require_argument(cloud, "cloud");
    require_argument(builder, "builder");
    require_struct_size("cloud", cloud->struct_size, sizeof(maq_point_cloud));
    if (cloud->point_count > 0) require_argument(cloud->xyz, "cloud.xyz");
    if (cloud->point_count > kMaxPoints) {
      throw Error(MAQ_ERROR_UNSUPPORTED, "The cloud has ", cloud->point_count, " points, over the limit of ",
                  kMaxPoints, "; make it thinner.");
    }
    const maq_scene_build_config config = read_config(given, "config", default_scene_build_config());
    BuildSettings settings = checked_settings(config);
    auto networks = open_scene_networks(context, settings.read_bundle(), settings.options.fitting.threads, true);
    PointCloud points;
    std::copy_n(cloud->origin, 3, points.origin.begin());
    points.reserve(cloud->point_count, false);
    for (uint64_t i = 0; i < cloud->point_count; ++i) {
      points.x.push_back(cloud->xyz[3 * i]);
      points.y.push_back(cloud->xyz[3 * i + 1]);
      points.z.push_back(cloud->xyz[3 * i + 2]);
    }
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
    if (!seen) return keep_error(builder, MAQ_CANCELLED, nullptr, "The photo was not added: the app cancelled it.");
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
    *scene = new maq_scene(builder->builder.finish());
    return MAQ_OK;
  });
}
