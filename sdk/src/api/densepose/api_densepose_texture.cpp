#include "api/boundary.h"
#include "api/densepose/densepose_handle.h"
#include "api/frame_handle.h"
#include "core/files/atomic_file.h"
#include "core/files/file.h"
#include "densepose/texture/surface_lookup.h"
#include "densepose/texture/surface_texture.h"
#include "image/convert.h"
#include "image/files/image_codecs.h"
#include "maquette/densepose_texture.h"

using namespace maq;

namespace {

constexpr int32_t kDefaultTilePx = 64, kMinTilePx = 8, kMaxTilePx = 512;

maq_densepose_texture_config default_texture_config() {
  maq_densepose_texture_config config{};
  config.struct_size = sizeof config;
  return config;
}

}  // namespace

struct maq_densepose_texture : maq::HandleOf<maq::HandleKind::kDensePoseTexture> {
  explicit maq_densepose_texture(int tile_px) : texture(tile_px) {}
  maq::SurfaceTexture texture;
};

maq_status maq_densepose_texture_config_init(maq_densepose_texture_config* config, uint32_t struct_size) {
  return init_config(__func__, config, struct_size, default_texture_config());
}

maq_status maq_densepose_texture_create(maq_context* context, const maq_densepose_texture_config* given,
                                        maq_densepose_texture** texture) {
  return guarded(context, __func__, [&] {
    require_argument(context, "context");
    require_argument(texture, "texture");
    maq_densepose_texture_config config = read_config(given, "config", default_texture_config());
    if (config.tile_px == 0) config.tile_px = kDefaultTilePx;
    require_range("config.tile_px", config.tile_px, kMinTilePx, kMaxTilePx);
    *texture = new maq_densepose_texture(config.tile_px);
    return MAQ_OK;
  });
}

void maq_densepose_texture_destroy(maq_densepose_texture* texture) { destroy(texture, "texture", __func__); }

maq_status maq_densepose_texture_add_person(maq_densepose_texture* texture, const maq_densepose_result* result,
                                            uint32_t index, const maq_frame* frame) {
  return guarded_alone(texture, "texture", __func__, [&] {
    require_argument(result, "result");
    require_argument(frame, "frame");
    require_index("index", index, result->result.people.size());
    const DensePlanes& planes = result->result.planes;
    require_frame_of(planes, frame->frame.image);
    texture->texture.add(frame->frame.image, planes, uint8_t(index + 1));
    return MAQ_OK;
  });
}

maq_status maq_densepose_texture_get_size(const maq_densepose_texture* texture, int32_t* width_px, int32_t* height_px) {
  return guarded(texture, __func__, [&] {
    require_argument(texture, "texture");
    require_argument(width_px, "width_px");
    require_argument(height_px, "height_px");
    *width_px = texture->texture.width_px();
    *height_px = texture->texture.height_px();
    return MAQ_OK;
  });
}

maq_status maq_densepose_texture_draw(maq_densepose_texture* texture, uint8_t* rgba, size_t stride_bytes,
                                      size_t size_bytes) {
  return guarded_alone(texture, "texture", __func__, [&] {
    require_argument(rgba, "rgba");
    const SurfaceTexture& drawn = texture->texture;
    drawn.draw(rgba, checked_stride(MAQ_PIXEL_RGBA8, drawn.width_px(), drawn.height_px(), stride_bytes, size_bytes));
    return MAQ_OK;
  });
}

maq_status maq_densepose_texture_save(maq_densepose_texture* texture, const char* path) {
  return guarded_alone(texture, "texture", __func__, [&] {
    require_argument(path, "path");
    if (lower_case_extension(path) != ".png") throw ArgumentError("path is \"", path, "\", but must end with .png.");
    AtomicFile file(path);
    const SurfaceTexture& drawn = texture->texture;
    std::vector<uint8_t> rgba(size_t(4) * size_t(drawn.width_px()) * size_t(drawn.height_px()));
    drawn.draw(rgba.data(), size_t(4) * size_t(drawn.width_px()));
    const std::vector<uint8_t> bytes =
        encode_stored_image(".png", packed_view(MAQ_PIXEL_RGBA8, drawn.width_px(), drawn.height_px(), rgba.data()));
    file.append(bytes.data(), bytes.size());
    file.commit();
    return MAQ_OK;
  });
}

maq_status maq_densepose_result_find_pixel(const maq_densepose_result* result, uint32_t index, int32_t part, float u,
                                           float v, float pixel_px[2], float* distance) {
  return guarded(result, __func__, [&] {
    require_argument(result, "result");
    require_argument(pixel_px, "pixel_px");
    require_index("index", index, result->result.people.size());
    require_range("part", part, 1, 24);
    require_range("u", u, 0.0f, 1.0f);
    require_range("v", v, 0.0f, 1.0f);
    const std::optional<SurfacePixel> found = find_surface_pixel(result->result.planes, uint8_t(index + 1), part, u, v);
    if (!found) {
      throw Error(MAQ_ERROR_NOT_FOUND, "Person ", index, " shows no pixel of part ", part, "; choose another part.");
    }
    pixel_px[0] = found->x_px;
    pixel_px[1] = found->y_px;
    if (distance != nullptr) *distance = found->distance;
    return MAQ_OK;
  });
}
