#include <cstring>
#include <limits>
#include <memory>

#include "api/boundary.h"
#include "api/scene/scene_conversions.h"
#include "image/files/image_file.h"
#include "scene/render/scene_renderer.h"

using namespace maq;

namespace {

maq_scene_renderer_config default_scene_renderer_config() {
  maq_scene_renderer_config config{};
  config.struct_size = sizeof config;
  config.image_pool_size = 4;
  config.allow_spinning = 1;
  return config;
}

}  // namespace

struct maq_scene_renderer : HandleOf<HandleKind::kSceneRenderer> {
  maq_scene_renderer(const Scene& scene, std::shared_ptr<SceneNetworks> networks, const RenderOptions& options,
                     size_t pool_size)
      : renderer(scene, std::move(networks), options), images(pool_size, "images") {}
  SceneRenderer renderer;
  BoundedPool<maq_scene_image> images;
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
    require_range("config.image_pool_size", config.image_pool_size, 1u, 64u);
    require_range("config.allow_spinning", config.allow_spinning, 0, 1);
    require_range("config.near_depth", config.near_depth, 0.0, std::numeric_limits<double>::max());
    require_range("config.use_background", config.use_background, 0, 1);
    require_range("config.draw_unseen_blocks", config.draw_unseen_blocks, 0, 1);
    require_range("config.refine_empty_parts", config.refine_empty_parts, 0, 1);
    require_provider("config.provider", config.provider);
    RenderOptions options;
    options.threads = scene_threads(config.threads);
    options.near = config.near_depth;
    if (config.use_background == 1) {
      options.background = {config.background[2], config.background[1], config.background[0]};
    }
    options.skips_unseen_blocks = config.draw_unseen_blocks == 0;
    options.skips_empty_parts = config.refine_empty_parts == 0;
    Bundle bundle = read_bundle_argument(config, "config", kSceneBundle);
    const std::string where = bundle.prefix;
    auto networks =
        open_scene_networks(context, std::move(bundle), options.threads, config.allow_spinning == 1, config.provider);
    if (scene->scene.networks_sha256 != networks->sha256()) {
      throw Error(MAQ_ERROR_BAD_BUNDLE, "The scene was built with other networks than bundle ", where,
                  " has; give the bundle that it was built with, or build the scene again.");
    }
    *renderer = new maq_scene_renderer(scene->scene, std::move(networks), options, config.image_pool_size);
    return MAQ_OK;
  });
}

void maq_scene_renderer_destroy(maq_scene_renderer* renderer) { destroy(renderer, "renderer", __func__); }

maq_status maq_scene_renderer_run(maq_scene_renderer* renderer, const maq_pinhole_camera* camera,
                                  maq_scene_image** image) {
  return guarded_alone(renderer, "renderer", __func__, [&] {
    require_argument(camera, "camera");
    require_argument(image, "image");
    const PinholeCamera from = undistorted_pinhole_of(*camera);
    BoundedPool<maq_scene_image>::Pooled handle = renderer->images.acquire();
    renderer->renderer.render(from, handle->image);
    *image = lend<maq_scene_image>(std::move(handle));
    return MAQ_OK;
  });
}

void maq_scene_image_release(maq_scene_image* image) {
  return_handle(image, "image", __func__, return_to_pool<maq_scene_image>);
}

maq_status maq_scene_image_get_plane(const maq_scene_image* image, maq_scene_plane plane, const void** pixels,
                                     size_t* stride_bytes) {
  return guarded(image, __func__, [&] {
    require_argument(image, "image");
    require_argument(pixels, "pixels");
    require_argument(stride_bytes, "stride_bytes");
    const int32_t wanted = number_in(plane);
    require_range("plane", wanted, int32_t(MAQ_SCENE_PLANE_BGR), int32_t(MAQ_SCENE_PLANE_DEPTH));
    const RenderedImage& from = image->image;
    const size_t width = size_t(from.width_px);
    switch (wanted) {
      case MAQ_SCENE_PLANE_BGR:
        *pixels = from.bgr.data();
        *stride_bytes = 3 * width;
        break;
      case MAQ_SCENE_PLANE_ALPHA:
        *pixels = from.alpha.data();
        *stride_bytes = width;
        break;
      case MAQ_SCENE_PLANE_DEPTH:
        *pixels = from.depth.data();
        *stride_bytes = sizeof(float) * width;
        break;
    }
    return MAQ_OK;
  });
}

maq_status maq_scene_image_get_stats(const maq_scene_image* image, maq_scene_image_stats* stats) {
  return guarded(image, __func__, [&] {
    require_argument(image, "image");
    const RenderCounts& from = image->image.counts;
    maq_scene_image_stats filled{};
    filled.project_ms = float(from.project_ms);
    filled.shade_ms = float(from.shade_ms + from.reduce_ms);
    filled.refine_ms = float(from.refine_ms);
    filled.resample_ms = float(from.coverage_ms + from.rotate_ms);
    filled.total_ms = float(from.all_ms);
    filled.drawn_block_count = from.projected_blocks;
    filled.drawn_point_count = from.projected_points;
    filled.shaded_point_count = from.shaded_points;
    filled.refined_pixel_count = int64_t(from.refined_pixels);
    filled.provider = from.provider;
    write_struct(stats, "stats", filled);
    return MAQ_OK;
  });
}

maq_status maq_scene_image_save(const maq_scene_image* image, const char* path, int32_t with_alpha) {
  return guarded(image, __func__, [&] {
    require_argument(image, "image");
    require_argument(path, "path");
    require_range("with_alpha", with_alpha, 0, 1);
    const RenderedImage& picture = image->image;
    const ImageView bgr{
        MAQ_PIXEL_BGR8, picture.width_px, picture.height_px, {{picture.bgr.data(), 3 * size_t(picture.width_px)}, {}}};
    if (with_alpha == 1) {
      write_image_file(bgr, picture.alpha.data(), path);
    } else {
      write_image_file(bgr, path);
    }
    return MAQ_OK;
  });
}
