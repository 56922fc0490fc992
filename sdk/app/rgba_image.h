// An image in memory, as textures take it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <maquette/maquette.hpp>
#include <vector>

namespace maquette {

struct RgbaImage {
  int width_px = 0, height_px = 0;
  std::vector<uint8_t> rgba;  // rows from top to bottom, 4 bytes a pixel

  void resize(int width, int height) {
    width_px = width, height_px = height;
    rgba.resize(size_t(width) * size_t(height) * 4);
  }
  void clear() { resize(0, 0); }
  bool empty() const { return rgba.empty(); }

  void copy_from(const Frame& frame) {
    const maq_frame_desc desc = frame.desc();
    resize(desc.width_px, desc.height_px);
    frame.copy_pixels(MAQ_PIXEL_RGBA8, rgba.data(), 0, rgba.size());
  }
  // A frame of these pixels, without a copy: they must stay as they are until the frame is gone.
  Frame as_frame(const Context& context) const {
    maq_frame_desc desc;
    check(maq_frame_desc_init(&desc, sizeof desc), nullptr);
    desc.format = MAQ_PIXEL_RGBA8;
    desc.width_px = width_px;
    desc.height_px = height_px;
    desc.planes[0] = rgba.data();
    return Frame(context, desc);
  }
};

}  // namespace maquette
