#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <utility>

#include "api/boundary.h"
#include "api/camera_argument.h"
#include "api/head/head_handle.h"
#include "core/worker_threads.h"
#include "head/render/head_renderer.h"
#include "image/files/image_file.h"

using namespace maq;

namespace {

maq_head_renderer_config default_head_renderer_config() {
  maq_head_renderer_config config{};
  config.struct_size = sizeof config;
  config.near_m = 0.01;
  config.shading = MAQ_HEAD_SHADING_COLOUR;
  config.light = 0.35f;
  config.smooth_edges = 1;
  config.image_pool_size = 4;
  return config;
}

head::MeshShading shading_of(const char* name, const maq_head_shading& given) {
  const int32_t shading = number_in(given);
  require_range(name, shading, int32_t(MAQ_HEAD_SHADING_COLOUR), int32_t(MAQ_HEAD_SHADING_DEPTH));
  constexpr std::array<head::MeshShading, 5> kShadings = {head::MeshShading::kColour, head::MeshShading::kShape,
                                                          head::MeshShading::kNormals, head::MeshShading::kTemplate,
                                                          head::MeshShading::kDepth};
  return kShadings[size_t(shading) - 1];
}

head::HeadRenderOptions options_of(const maq_head_renderer_config& config) {
  require_range("config.threads", config.threads, 0, kMaxThreads);
  require_range("config.near_m", config.near_m, 1e-6, 1e6);
  require_range("config.light", config.light, 0.0f, 1.0f);
  require_range("config.smooth_edges", config.smooth_edges, 0, 1);
  require_range("config.use_background", config.use_background, 0, 1);
  require_range("config.image_pool_size", config.image_pool_size, 1u, 64u);
  head::HeadRenderOptions options;
  options.threads = config.threads != 0 ? config.threads : default_threads();
  options.near_m = config.near_m;
  options.is_smooth = config.smooth_edges == 1;
  options.light = config.light;
  options.shading = shading_of("config.shading", config.shading);
  if (config.use_background == 1) {
    options.background_rgb = {config.background[0], config.background[1], config.background[2]};
  }
  return options;
}

}  // namespace

struct maq_head_image : HandleOf<HandleKind::kHeadImage> {
  head::HeadPicture picture;
  BoundedPool<maq_head_image>::Deleter deleter;
};

struct maq_head_renderer : HandleOf<HandleKind::kHeadRenderer> {
  maq_head_renderer(const head::HeadMesh& mesh, std::optional<head::MeshTexture> texture,
                    const head::HeadRenderOptions& options, size_t pool_size)
      : renderer(mesh, std::move(texture), options), images(pool_size, "images") {}
  head::HeadRenderer renderer;
  BoundedPool<maq_head_image> images;
};

maq_status maq_head_get_camera(const maq_head* head, uint32_t index, maq_pinhole_camera* camera) {
  return guarded(head, __func__, [&] {
    require_argument(head, "head");
    require_index("index", index, head->head.cameras.size());
    const head::HeadCamera& from = head->head.cameras[index];
    PinholeCamera made;
    made.intrinsics() = {from.width_px, from.height_px, from.focal_px, from.focal_px, from.cx_px, from.cy_px};
    std::copy(from.head_to_camera.rotation.begin(), from.head_to_camera.rotation.end(), made.rotation.begin());
    const Vec3 centre = head->head.scale.metres_per_unit * head::inverse(from.head_to_camera).translation;
    made.centre = {centre.x, centre.y, centre.z};
    write_struct(camera, "camera", camera_of(made));
    return MAQ_OK;
  });
}

maq_status maq_head_renderer_config_init(maq_head_renderer_config* config, uint32_t struct_size) {
  return init_config(__func__, config, struct_size, default_head_renderer_config());
}

maq_status maq_head_renderer_create(maq_context* context, const maq_head_renderer_config* given, maq_head* head,
                                    maq_head_renderer** renderer) {
  return guarded_alone(head, "head", __func__, [&] {
    require_argument(context, "context");
    require_argument(renderer, "renderer");
    const maq_head_renderer_config config = read_config(given, "config", default_head_renderer_config());
    const head::HeadRenderOptions options = options_of(config);
    const head::HeadMesh& mesh = mesh_of(*head, config.mesh);
    std::optional<head::MeshTexture> texture;
    if (const std::vector<uint8_t>& jpeg = texture_of(*head); !jpeg.empty()) {
      Frame decoded;
      decode_image(jpeg, "The head's texture", decoded);
      texture.emplace(decoded.image);
    }
    *renderer = new maq_head_renderer(mesh, std::move(texture), options, config.image_pool_size);
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

maq_status maq_head_renderer_run(maq_head_renderer* renderer, const maq_pinhole_camera* camera,
                                 maq_head_image** image) {
  return guarded_alone(renderer, "renderer", __func__, [&] {
    require_argument(camera, "camera");
    require_argument(image, "image");
    const PinholeCamera from = undistorted_pinhole_of(*camera);
    BoundedPool<maq_head_image>::Pooled handle = renderer->images.acquire();
    renderer->renderer.render(from, handle->picture);
    *image = lend<maq_head_image>(std::move(handle));
    return MAQ_OK;
  });
}

void maq_head_image_release(maq_head_image* image) {
  return_handle(image, "image", __func__, return_to_pool<maq_head_image>);
}

maq_status maq_head_image_get_plane(const maq_head_image* image, maq_head_plane plane, const void** pixels,
                                    size_t* stride_bytes) {
  return guarded(image, __func__, [&] {
    require_argument(image, "image");
    require_argument(pixels, "pixels");
    require_argument(stride_bytes, "stride_bytes");
    const int32_t wanted = number_in(plane);
    require_range("plane", wanted, int32_t(MAQ_HEAD_PLANE_BGR), int32_t(MAQ_HEAD_PLANE_TEMPLATE_POINTS));
    const head::HeadPicture& from = image->picture;
    const size_t width = size_t(from.width_px);
    switch (wanted) {
      case MAQ_HEAD_PLANE_BGR:
        *pixels = from.bgr.data();
        *stride_bytes = 3 * width;
        break;
      case MAQ_HEAD_PLANE_ALPHA:
        *pixels = from.alpha.data();
        *stride_bytes = width;
        break;
      case MAQ_HEAD_PLANE_DEPTH:
        *pixels = from.depth.data();
        *stride_bytes = sizeof(float) * width;
        break;
      case MAQ_HEAD_PLANE_NORMALS:
        *pixels = from.normals.data();
        *stride_bytes = 3 * sizeof(float) * width;
        break;
      case MAQ_HEAD_PLANE_TEMPLATE_POINTS:
        *pixels = from.template_points.data();
        *stride_bytes = 3 * sizeof(float) * width;
        break;
    }
    return MAQ_OK;
  });
}

maq_status maq_head_image_save(const maq_head_image* image, const char* path, int32_t with_alpha) {
  return guarded(image, __func__, [&] {
    require_argument(image, "image");
    require_argument(path, "path");
    require_range("with_alpha", with_alpha, 0, 1);
    const head::HeadPicture& picture = image->picture;
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
