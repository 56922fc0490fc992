#include <array>
#include <memory>
#include <optional>
#include <utility>

#include "api/boundary.h"
#include "api/camera_argument.h"
#include "api/head/head_handle.h"
#include "api/image/image_handle.h"
#include "core/worker_threads.h"
#include "head/render/head_renderer.h"
#include "image/files/image_file.h"

using namespace maq;

namespace {

maq_head_renderer_config default_head_renderer_config() {
  maq_head_renderer_config config{};
  config.struct_size = sizeof config;
  return config;
}

head::MeshShading shading_of(const char* name, const maq_head_shading& given) {
  const int32_t shading = number_in(given);
  require_range(name, shading, int32_t(MAQ_HEAD_SHADING_COLOUR), int32_t(MAQ_HEAD_SHADING_DEPTH));
  constexpr std::array<head::MeshShading, 5> kShadings = {head::MeshShading::kColour, head::MeshShading::kShape,
                                                          head::MeshShading::kNormals, head::MeshShading::kTemplate,
                                                          head::MeshShading::kDepth};
  return kShadings[size_t(shading)];
}

head::HeadRenderOptions options_of(const maq_head_renderer_config& config) {
  require_range("config.threads", config.threads, 0, kMaxThreads);
  require_range("config.disable_antialiasing", config.disable_antialiasing, 0, 1);
  require_range("config.use_background", config.use_background, 0, 1);
  require_range("config.image_pool_size", config.image_pool_size, 0u, 64u);
  head::HeadRenderOptions options;
  options.threads = config.threads != 0 ? config.threads : default_threads();
  if (config.near_m != 0) {
    require_range("config.near_m", config.near_m, 1e-6, 1e6);
    options.near_m = config.near_m;
  }
  options.is_smooth = config.disable_antialiasing == 0;
  if (config.shading_strength == MAQ_HEAD_SHADING_STRENGTH_OFF) {
    options.shading_strength = 0;
  } else if (config.shading_strength != 0) {
    require_range("config.shading_strength", config.shading_strength, 0.0f, 1.0f);
    options.shading_strength = config.shading_strength;
  }
  options.shading = shading_of("config.shading", config.shading);
  if (config.use_background == 1) {
    options.background_rgb = {config.background[0], config.background[1], config.background[2]};
  }
  return options;
}

}  // namespace

struct maq_head_renderer : HandleOf<HandleKind::kHeadRenderer> {
  maq_head_renderer(const head::HeadMesh& mesh, std::optional<head::MeshTexture> texture,
                    const head::HeadRenderOptions& options, size_t pool_size)
      : renderer(mesh, std::move(texture), options), images(pool_size, "images") {}
  head::HeadRenderer renderer;
  BoundedPool<maq_image> images;
};

maq_status maq_head_renderer_config_init(maq_head_renderer_config* config, uint32_t struct_size) {
  return init_config(__func__, config, struct_size, default_head_renderer_config());
}

maq_status maq_head_renderer_create(maq_context* context, const maq_head_renderer_config* given,
                                    const maq_head_mesh* mesh, maq_head_renderer** renderer) {
  return guarded(context, __func__, [&] {
    require_argument(context, "context");
    require_argument(mesh, "mesh");
    require_argument(renderer, "renderer");
    const maq_head_renderer_config config = read_config(given, "config", default_head_renderer_config());
    const head::HeadRenderOptions options = options_of(config);
    std::optional<head::MeshTexture> texture;
    if (!mesh->texture_jpeg.empty()) {
      Frame decoded;
      decode_image(mesh->texture_jpeg, "The head's texture", decoded);
      texture.emplace(decoded.image);
    }
    *renderer = new maq_head_renderer(mesh->mesh, std::move(texture), options,
                                      config.image_pool_size != 0 ? config.image_pool_size : kDefaultImagePool);
    return MAQ_OK;
  });
}

void maq_head_renderer_destroy(maq_head_renderer* renderer) { destroy(renderer, "renderer", __func__); }

maq_status maq_head_renderer_get_camera(const maq_head_renderer* renderer, double yaw_rad, double pitch_rad,
                                        int32_t width_px, int32_t height_px, maq_pinhole_camera* camera) {
  return guarded(renderer, __func__, [&] {
    require_argument(renderer, "renderer");
    const PinholeCamera made = renderer->renderer.orbit_camera(yaw_rad, pitch_rad, width_px, height_px);
    write_struct(camera, "camera", camera_of(made));
    return MAQ_OK;
  });
}

maq_status maq_head_renderer_set_shading(maq_head_renderer* renderer, maq_head_shading shading) {
  return guarded_alone(renderer, "renderer", __func__, [&] {
    renderer->renderer.set_shading(shading_of("shading", shading));
    return MAQ_OK;
  });
}

maq_status maq_head_renderer_run(maq_head_renderer* renderer, const maq_pinhole_camera* camera, maq_image** image) {
  return guarded_alone(renderer, "renderer", __func__, [&] {
    require_argument(camera, "camera");
    require_argument(image, "image");
    const PinholeCamera from = undistorted_pinhole_of(*camera);
    BoundedPool<maq_image>::Pooled handle = renderer->images.acquire();
    renderer->renderer.render(from, handle->image);
    *image = lend<maq_image>(std::move(handle));
    return MAQ_OK;
  });
}
