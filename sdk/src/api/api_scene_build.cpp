#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <optional>

#include "api/boundary.h"
#include "api/scene_arguments.h"
#include "core/clock.h"
#include "scene/build/build_scene.h"
#include "scene/capture/posed_view.h"
#include "scene/format/scene_packing.h"

using namespace maq;

namespace {

// A config that was checked.
struct BuildSettings {
  int threads = 1;
  std::string bundle_path;
  int long_side_px = 0;
  ScenePacking packing;
  BuildOptions points;
  uint64_t most_points = 0;
  BuildProgress progress;
};

maq_scene_build_config default_config() {
  maq_scene_build_config config{};
  config.struct_size = sizeof config;
  config.long_side_px = 640;
  config.coefficient_bits = 8;
  config.min_variation = -1;
  config.visibility_scale = 1;
  return config;
}

BuildSettings checked_settings(const maq_scene_build_config& config) {
  require_argument(config.bundle_path, "config.bundle_path");
  BuildSettings settings;
  settings.threads = scene_threads(config.threads);
  settings.bundle_path = config.bundle_path;
  require_range("config.long_side_px", config.long_side_px, 0, MAQ_MAX_SIDE_PX);
  settings.long_side_px = config.long_side_px;
  switch (config.coefficient_bits) {
    case 8: break;
    case 16: settings.packing.coefficients = Coefficients::kInt16; break;
    case 32:
      settings.packing.coefficients = Coefficients::kFloat32;
      settings.packing.places = Places::kFloat32;
      break;
    default: throw ArgumentError("config.coefficient_bits is ", config.coefficient_bits, ", but must be 8, 16 or 32.");
  }
  if (std::isnan(config.min_variation)) throw ArgumentError("config.min_variation is not a number.");
  // Colours are 0 to 1, and what is over this would not fit into a float.
  constexpr double kMostVariation = 1e30;
  if (config.min_variation >= 0) {
    settings.packing.least_variation = float(std::min(config.min_variation, kMostVariation));
  } else if (config.coefficient_bits == 8) {
    // At most 40 bytes a point, also where every look varies: the other half varies less.
    constexpr float kMostVarying = 0.5f;
    settings.packing.most_varying = kMostVarying;
  }
  settings.points.visibility_scale = config.visibility_scale;
  settings.points.near = config.near_depth;
  settings.points.threads = settings.threads;
  if (config.max_memory_bytes != 0) settings.points.most_bytes = config.max_memory_bytes;
  settings.most_points = config.max_points;
  require_range("config.use_held_out", config.use_held_out, 0, 1);
  if (config.progress_callback != nullptr) {
    settings.progress = [callback = config.progress_callback, user_data = config.progress_user_data](
                            double done, const std::string& what) {
      return callback(user_data, done, what.c_str()) != 0;
    };
  }
  return settings;
}

void fill(maq_scene_build_stats& stats, const BuildTimes& times) {
  stats.visibility_ms = times.visibility_ms;
  stats.align_ms = times.turning_ms;
  stats.extract_ms = times.extractor_ms;
  stats.accumulate_ms = times.moments_ms;
  stats.solve_ms = times.solving_ms;
}

// As it is where it has no length; the builder refuses that.
std::array<double, 3> unit_vector(const double (&vector)[3]) {
  const double length = std::hypot(vector[0], vector[1], vector[2]);
  std::array<double, 3> unit = {vector[0], vector[1], vector[2]};
  if (length > 0 && std::isfinite(length)) {
    for (double& value : unit) value /= length;
  }
  return unit;
}

Scene packed(const ModelledPoints& points, const ScenePacking& packing, const SceneNetworks& networks) {
  Scene scene = make_scene(points, packing);
  scene.networks_sha256 = networks.sha256();
  return scene;
}

}  // namespace

struct maq_scene_builder : Handle {
  maq_scene_builder(BuildSettings checked, std::shared_ptr<SceneNetworks> opened, PointCloud cloud,
                    const std::array<double, 3>& up)
      : settings(std::move(checked)),
        networks(std::move(opened)),
        cloud_points(cloud.count()),
        builder(std::move(cloud), up, *networks, settings.points) {}
  BuildSettings settings;
  std::shared_ptr<SceneNetworks> networks;
  uint64_t cloud_points;
  SceneBuilder builder;
  uint32_t unused_views = 0;
  double load_ms = 0, packing_ms = 0;
};

maq_status maq_scene_build_config_init(maq_scene_build_config* config, uint32_t struct_size) {
  return init_config(__func__, config, struct_size, default_config(), sizeof(maq_scene_build_config));
}

maq_status maq_scene_build(maq_context* context, const maq_scene_build_config* given, const maq_capture* capture,
                           maq_scene_build_stats* stats, maq_scene** scene) {
  return guarded(context, __func__, [&] {
    require_argument(context, "context");
    require_argument(given, "config");
    require_argument(capture, "capture");
    require_argument(scene, "scene");
    const maq_scene_build_config config =
        read_config(given, "config", default_config(), sizeof(maq_scene_build_config));
    const BuildSettings settings = checked_settings(config);
    maq_scene_build_stats filled{};
    if (stats != nullptr) require_struct_size("stats", stats->struct_size, sizeof filled, sizeof filled);
    const auto networks = open_scene_networks(context, settings.bundle_path.c_str(), settings.threads, true);
    CaptureBuildOptions options;
    options.points = settings.points;
    options.long_side_px = settings.long_side_px;
    options.most_views = config.max_views;
    options.uses_held_out = config.use_held_out == 1;
    Capture copy = capture->capture;
    thin_out(copy.cloud, settings.most_points);
    filled.cloud_point_count = copy.cloud.count();
    const std::optional<BuiltCapture> built =
        build_from_capture(std::move(copy), *networks, options, settings.progress);
    if (!built) return keep_error(context, MAQ_CANCELLED, nullptr, "The progress callback ended the building.");
    networks->forget_extractor();
    const Stopwatch watch;
    auto made = std::make_unique<maq_scene>(packed(built->points, settings.packing, *networks));
    filled.pack_ms = watch.elapsed_ms();
    if (stats != nullptr) {
      filled.view_count = uint32_t(built->views);
      for (const Dropped& dropped : built->dropped) filled.unused_view_count += uint32_t(dropped.count);
      filled.seen_point_count = built->points.count();
      filled.load_ms = built->loading_ms;
      fill(filled, built->times);
      write_struct(stats, "stats", filled, sizeof filled);
    }
    *scene = made.release();
    return MAQ_OK;
  });
}

maq_status maq_scene_builder_create(maq_context* context, const maq_scene_build_config* given,
                                    const maq_point_cloud* cloud, maq_scene_builder** builder) {
  return guarded(context, __func__, [&] {
    require_argument(context, "context");
    require_argument(given, "config");
    require_argument(cloud, "cloud");
    require_argument(builder, "builder");
    require_struct_size("cloud", cloud->struct_size, sizeof(maq_point_cloud), sizeof(maq_point_cloud));
    if (cloud->point_count > 0) require_argument(cloud->xyz, "cloud.xyz");
    if (cloud->point_count > kMostPoints) {
      throw Error(MAQ_ERROR_UNSUPPORTED, "The cloud has ", cloud->point_count, " points, over the limit of ",
                  kMostPoints, "; make it thinner.");
    }
    const maq_scene_build_config config =
        read_config(given, "config", default_config(), sizeof(maq_scene_build_config));
    BuildSettings settings = checked_settings(config);
    auto networks = open_scene_networks(context, settings.bundle_path.c_str(), settings.threads, true);
    PointCloud points;
    std::copy_n(cloud->origin, 3, points.origin.begin());
    points.reserve(cloud->point_count, false);
    for (uint64_t i = 0; i < cloud->point_count; ++i) {
      points.x.push_back(cloud->xyz[3 * i]);
      points.y.push_back(cloud->xyz[3 * i + 1]);
      points.z.push_back(cloud->xyz[3 * i + 2]);
    }
    thin_out(points, settings.most_points);
    *builder =
        new maq_scene_builder(std::move(settings), std::move(networks), std::move(points), unit_vector(cloud->up));
    return MAQ_OK;
  });
}

void maq_scene_builder_destroy(maq_scene_builder* builder) { delete builder; }

maq_status maq_scene_builder_add_view(maq_scene_builder* builder, const maq_frame* photo,
                                      const maq_pinhole_camera* camera, uint64_t* seen_points) {
  return guarded(builder, __func__, [&] {
    require_argument(builder, "builder");
    require_argument(photo, "photo");
    require_argument(camera, "camera");
    require_struct_size("camera", camera->struct_size, sizeof(maq_pinhole_camera), sizeof(maq_pinhole_camera));
    check_camera(pinhole_of(*camera), "The photo's camera");
    check_distortion(*camera);
    const Stopwatch watch;
    PosedView view;
    view.load(photo->frame.image, lens_of(*camera), pinhole_of(*camera), builder->settings.long_side_px);
    builder->load_ms += watch.elapsed_ms();
    const std::optional<size_t> seen =
        builder->builder.add_view(view.image(), view.valid(), view.camera(), builder->settings.progress);
    if (!seen) return keep_error(builder, MAQ_CANCELLED, nullptr, "The photo was not added: the app cancelled it.");
    if (*seen == 0) builder->unused_views += 1;
    if (seen_points != nullptr) *seen_points = *seen;
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
  return guarded(builder, __func__, [&] {
    require_argument(builder, "builder");
    maq_scene_build_stats filled{};
    filled.view_count = uint32_t(builder->builder.views());
    filled.unused_view_count = builder->unused_views;
    filled.cloud_point_count = builder->cloud_points;
    filled.seen_point_count = builder->builder.seen_points();
    fill(filled, builder->builder.times());
    filled.load_ms = builder->load_ms;
    filled.pack_ms = builder->packing_ms;
    write_struct(stats, "stats", filled, sizeof filled);
    return MAQ_OK;
  });
}

maq_status maq_scene_builder_finish(maq_scene_builder* builder, maq_scene** scene) {
  return guarded(builder, __func__, [&] {
    require_argument(builder, "builder");
    require_argument(scene, "scene");
    const ModelledPoints points = builder->builder.finish();
    const Stopwatch watch;
    *scene = new maq_scene(packed(points, builder->settings.packing, *builder->networks));
    builder->packing_ms += watch.elapsed_ms();
    return MAQ_OK;
  });
}
