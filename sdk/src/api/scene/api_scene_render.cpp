#include <limits>
#include <memory>
#include <optional>

#include "api/boundary.h"
#include "api/image/image_handle.h"
#include "api/scene/scene_conversions.h"
#include "scene/render/scene_renderer.h"
#include "scene/splats/splat_renderer.h"

using namespace maq;

namespace {

maq_scene_renderer_config default_scene_renderer_config() {
  maq_scene_renderer_config config{};
  config.struct_size = sizeof config;
  return config;
}

maq_scene_render_stats stats_of(const RenderCounts& from) {
  maq_scene_render_stats stats{};
  stats.struct_size = sizeof stats;
  stats.project_ms = float(from.project_ms);
  stats.shade_ms = float(from.shade_ms + from.reduce_ms);
  stats.refine_ms = float(from.refine_ms);
  stats.resample_ms = float(from.coverage_ms + from.rotate_ms);
  stats.total_ms = float(from.all_ms);
  stats.drawn_block_count = from.projected_blocks;
  stats.drawn_point_count = from.projected_points;
  stats.shaded_point_count = from.shaded_points;
  stats.refined_pixel_count = int64_t(from.refined_pixels);
  stats.provider = from.provider;
  return stats;
}

maq_scene_render_stats stats_of(const SplatRenderCounts& from) {
  maq_scene_render_stats stats{};
  stats.struct_size = sizeof stats;
  stats.project_ms = float(from.project_ms + from.sort_ms);
  stats.shade_ms = float(from.blend_ms);
  stats.total_ms = float(from.all_ms);
  stats.drawn_block_count = from.drawn_chunks;
  stats.drawn_point_count = from.drawn_splats;
  stats.shaded_point_count = from.visible_splats;
  stats.provider = MAQ_PROVIDER_CPU;
  return stats;
}

}  // namespace

struct maq_scene_renderer : HandleOf<HandleKind::kSceneRenderer> {
  explicit maq_scene_renderer(size_t pool_size) : images(pool_size, "images") {}
  // One of both.
  std::optional<SceneRenderer> points;
  std::optional<SplatRenderer> splats;
  BoundedPool<maq_image> images;
};

maq_status maq_scene_renderer_config_init(maq_scene_renderer_config* config, uint32_t struct_size) {
  return init_config(__func__, config, struct_size, default_scene_renderer_config());
}

maq_status maq_scene_renderer_create(maq_context* context, const maq_scene_renderer_config* given,
                                     const maq_scene* scene, maq_scene_renderer** renderer) {
  return guarded(context, __func__, [&] {
    require_argument(context, "context");
    require_argument(scene, "scene");
    require_argument(renderer, "renderer");
    const maq_scene_renderer_config config = read_config(given, "config", default_scene_renderer_config());
    require_range("config.image_pool_size", config.image_pool_size, 0u, 64u);
    require_range("config.near_depth", config.near_depth, 0.0, std::numeric_limits<double>::max());
    require_range("config.use_background", config.use_background, 0, 1);
    const SessionSettings settings = scene_session_settings(config.model);
    auto made =
        std::make_unique<maq_scene_renderer>(config.image_pool_size != 0 ? config.image_pool_size : kDefaultImagePool);
    if (scene->splats) {
      SplatRenderOptions options;
      options.threads = settings.threads;
      options.near = config.near_depth;
      if (config.use_background == 1) {
        options.background = {config.background[2], config.background[1], config.background[0]};
      }
      made->splats.emplace(*scene->splats, options);
      *renderer = made.release();
      return MAQ_OK;
    }
    RenderOptions options;
    options.threads = settings.threads;
    options.near = config.near_depth;
    if (config.use_background == 1) {
      options.background = {config.background[2], config.background[1], config.background[0]};
    }
    Bundle bundle = read_bundle_argument(config.model, "config.model", kSceneBundle);
    const std::string where = bundle.prefix;
    auto networks = open_scene_networks(context, std::move(bundle), settings);
    if (scene->scene.networks_sha256 != networks->sha256()) {
      throw Error(MAQ_ERROR_BAD_BUNDLE, "Other networks than those of bundle ", where,
                  " built the scene; give the bundle that built it, or build the scene again.");
    }
    made->points.emplace(scene->scene, std::move(networks), options);
    *renderer = made.release();
    return MAQ_OK;
  });
}

void maq_scene_renderer_destroy(maq_scene_renderer* renderer) { destroy(renderer, "renderer", __func__); }

maq_status maq_scene_renderer_run(maq_scene_renderer* renderer, const maq_pinhole_camera* camera, maq_image** image) {
  return guarded_alone(renderer, "renderer", __func__, [&] {
    require_argument(camera, "camera");
    require_argument(image, "image");
    const PinholeCamera from = undistorted_pinhole_of(*camera);
    BoundedPool<maq_image>::Pooled handle = renderer->images.acquire();
    handle->scene_stats = renderer->splats ? stats_of(renderer->splats->render(from, handle->image))
                                           : stats_of(renderer->points->render(from, handle->image));
    *image = lend<maq_image>(std::move(handle));
    return MAQ_OK;
  });
}

maq_status maq_image_get_scene_stats(const maq_image* image, maq_scene_render_stats* stats) {
  return guarded(image, __func__, [&] {
    require_argument(image, "image");
    if (image->scene_stats.struct_size == 0) {
      throw ArgumentError("image is of a head; maq_image_get_scene_stats is for images of maq_scene_renderer_run.");
    }
    write_struct(stats, "stats", image->scene_stats);
    return MAQ_OK;
  });
}
