#include "head/mesh/mesh_texture.h"

#include <algorithm>
#include <cstddef>
#include <utility>

namespace maq::head {

MeshTexture::MeshTexture(const ImageView& bgr) {
  Level whole{bgr.width_px, bgr.height_px, std::vector<uint8_t>(3 * size_t(bgr.width_px) * size_t(bgr.height_px))};
  copy_packed(bgr, whole.bgr.data());
  levels_.push_back(std::move(whole));
  while (std::min(levels_.back().width_px, levels_.back().height_px) >= 2) {
    const Level& of = levels_.back();
    Level half{of.width_px / 2, of.height_px / 2, {}};
    half.bgr.reserve(3 * size_t(half.width_px) * size_t(half.height_px));
    const size_t below = 3 * size_t(of.width_px);
    for (int row = 0; row < half.height_px; ++row) {
      for (int column = 0; column < half.width_px; ++column) {
        const uint8_t* const corner = &of.bgr[size_t(2 * row) * below + 6 * size_t(column)];
        for (size_t channel = 0; channel < 3; ++channel) {
          const uint8_t* const from = corner + channel;
          half.bgr.push_back(uint8_t((from[0] + from[3] + from[below] + from[below + 3] + 2) / 4));
        }
      }
    }
    levels_.push_back(std::move(half));
  }
}

int MeshTexture::level_of(double texels, double pixels) const {
  int level = 0;
  // Half way between two levels, texels of one level are as much too small as texels of the other are too large.
  for (double of_pixel = texels / pixels; of_pixel > 2 && level + 1 < int(levels_.size()); of_pixel /= 4) ++level;
  return level;
}

std::array<float, 3> MeshTexture::colour(float u, float v, int level) const {
  const Level& of = levels_[size_t(level)];
  const auto texel = [](float at, int count, int& first, int& second) {
    const float given = at * float(count) - 0.5f;
    const float along = given > 0 ? std::min(given, float(count - 1)) : 0.0f;  // 0 also for NaN
    first = int(along);
    second = std::min(first + 1, count - 1);
    return along - float(first);
  };
  int left = 0, right = 0, top = 0, bottom = 0;
  const float x = texel(u, of.width_px, left, right), y = texel(v, of.height_px, top, bottom);
  const auto at = [&](int row, int column) {
    return &of.bgr[3 * (size_t(row) * size_t(of.width_px) + size_t(column))];
  };
  const uint8_t *const a = at(top, left), *const b = at(top, right), *const c = at(bottom, left),
                       *const d = at(bottom, right);
  std::array<float, 3> rgb{};
  for (size_t k = 0; k < 3; ++k) {
    const float above = float(a[k]) + x * (float(b[k]) - float(a[k]));
    const float below = float(c[k]) + x * (float(d[k]) - float(c[k]));
    rgb[2 - k] = above + y * (below - above);
  }
  return rgb;
}

}  // namespace maq::head
