// Textures of people, for C++17; a part of maquette.hpp.
#ifndef MAQUETTE_DENSEPOSE_TEXTURE_HPP_
#define MAQUETTE_DENSEPOSE_TEXTURE_HPP_

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "maquette/densepose.hpp"
#include "maquette/densepose_texture.h"

namespace maquette {

// The colours of one person on the body surface, from many frames.
class DensePoseTexture {
 public:
  // tile_px: width and height of the tile of a part; 0: the default.
  explicit DensePoseTexture(const Context& context, int32_t tile_px = 0) {
    maq_densepose_texture_config config;
    check(maq_densepose_texture_config_init(&config, sizeof config));
    config.tile_px = tile_px;
    maq_densepose_texture* made = nullptr;
    check(maq_densepose_texture_create(context.get(), &config, &made));
    owner_ = Owner<maq_densepose_texture, maq_densepose_texture_destroy>(made);
  }

  maq_densepose_texture* get() const { return owner_.get(); }

  // `frame` is the frame of the result.
  void add_person(const DensePoseResult& result, uint32_t index, const Frame& frame) {
    check(maq_densepose_texture_add_person(get(), result.get(), index, frame.get()));
  }

  // Width and height in pixels.
  std::array<int32_t, 2> size_px() const {
    std::array<int32_t, 2> size{};
    check(maq_densepose_texture_get_size(get(), &size[0], &size[1]));
    return size;
  }

  // Returns the rows of maq_densepose_texture_draw without padding: R, G, B, A.
  std::vector<uint8_t> draw() {
    const std::array<int32_t, 2> size = size_px();
    std::vector<uint8_t> rgba(size_t(4) * size_t(size[0]) * size_t(size[1]));
    check(maq_densepose_texture_draw(get(), rgba.data(), 0, rgba.size()));
    return rgba;
  }

  void save(const std::string& path) { check(maq_densepose_texture_save(get(), path.c_str())); }

 private:
  Owner<maq_densepose_texture, maq_densepose_texture_destroy> owner_;
};

// A pixel that shows a point of the body surface; see maq_densepose_result_find_pixel.
struct SurfacePixel {
  std::array<float, 2> pixel_px{};
  float distance = 0;
};

// Returns nothing if no pixel of the person shows the part.
inline std::optional<SurfacePixel> find_pixel(const DensePoseResult& result, uint32_t index, int32_t part, float u,
                                              float v) {
  SurfacePixel found;
  const maq_status status =
      maq_densepose_result_find_pixel(result.get(), index, part, u, v, found.pixel_px.data(), &found.distance);
  if (status == MAQ_ERROR_NOT_FOUND) return std::nullopt;
  check(status);
  return found;
}

}  // namespace maquette

#endif  // MAQUETTE_DENSEPOSE_TEXTURE_HPP_
