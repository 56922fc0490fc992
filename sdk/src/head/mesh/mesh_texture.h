// An image that meshes are drawn with, by their texture coordinates.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/frame.h"

namespace maq::head {

class MeshTexture {
 public:
  // Copies a BGR8 image.
  explicit MeshTexture(const ImageView& bgr);

  // The level whose texels are about as large as pixels, for a surface that `texels` of the whole texture and `pixels`
  // of the drawn one cover; 0 is the whole texture, each further level half as wide and high.
  int level_of(double texels, double pixels) const;

  // R, G, B, 0 to 255, between the four nearest texels of a level; (u, v): to the right and down, 0 to 1.
  std::array<float, 3> colour(float u, float v, int level) const;

  int width_px() const { return levels_[0].width_px; }
  int height_px() const { return levels_[0].height_px; }

 private:
  struct Level {
    int width_px, height_px;
    std::vector<uint8_t> bgr;
  };
  std::vector<Level> levels_;
};

}  // namespace maq::head
