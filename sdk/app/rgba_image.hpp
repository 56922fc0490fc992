// A picture in memory, as textures take it.
#ifndef MAQUETTE_PICTURE_HPP_
#define MAQUETTE_PICTURE_HPP_

#include <cstddef>
#include <cstdint>
#include <vector>

#include "maquette/maquette.hpp"

namespace maquette {

struct Picture {
  int width_px = 0, height_px = 0;
  std::vector<uint8_t> rgba;  // rows from top to bottom, 4 bytes a pixel

  void resize(int width, int height) {
    width_px = width, height_px = height;
    rgba.resize(size_t(width) * size_t(height) * 4);
  }
  bool empty() const { return rgba.empty(); }

  void take(const Frame& frame) {
    resize(frame.desc().width_px, frame.desc().height_px);
    frame.copy_pixels(MAQ_PIXEL_RGBA8, rgba.data(), 0, rgba.size());
  }
  // For the library, without a copy: the pixels must stay until the frame is gone.
  Frame frame(const Context& context) const {
    maq_frame_desc desc;
    check(maq_frame_desc_init(&desc, sizeof desc));
    desc.format = MAQ_PIXEL_RGBA8;
    desc.width_px = width_px;
    desc.height_px = height_px;
    desc.planes[0] = rgba.data();
    return Frame(context, desc);
  }
};

}  // namespace maquette

#endif  // MAQUETTE_PICTURE_HPP_
