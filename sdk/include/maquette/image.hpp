// Rendered images, for C++17; a part of maquette.hpp.
#ifndef MAQUETTE_IMAGE_HPP_
#define MAQUETTE_IMAGE_HPP_

#include <string>

#include "maquette/context.hpp"
#include "maquette/features.h"
#include "maquette/image.h"
#if MAQ_HAS_SCENES
#include "maquette/scene.h"
#endif

namespace maquette {

// An image of HeadRenderer or SceneRenderer.
class Image {
 public:
  // Takes over an image of the C API.
  explicit Image(maq_image* image) : owner_(image) {
    if (image != nullptr) check(maq_image_get_size(image, &width_px_, &height_px_));
  }

  maq_image* get() const { return owner_.get(); }
  int width_px() const { return width_px_; }
  int height_px() const { return height_px_; }

  // Rows of *stride_bytes.
  const void* plane(maq_image_plane plane, size_t* stride_bytes) const {
    const void* pixels = nullptr;
    check(maq_image_get_plane(get(), plane, &pixels, stride_bytes));
    return pixels;
  }

#if MAQ_HAS_SCENES
  // For images of SceneRenderer.
  maq_scene_render_stats scene_stats() const {
    maq_scene_render_stats stats{};
    stats.struct_size = sizeof stats;
    check(maq_image_get_scene_stats(get(), &stats));
    return stats;
  }
#endif

  void save(const std::string& path, maq_image_alpha alpha = MAQ_IMAGE_ALPHA_OFF) const {
    check(maq_image_save(get(), path.c_str(), alpha));
  }

 private:
  Owner<maq_image, maq_image_release> owner_;
  int32_t width_px_ = 0, height_px_ = 0;
};

}  // namespace maquette

#endif  // MAQUETTE_IMAGE_HPP_
