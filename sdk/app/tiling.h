// Arranges images of one size in rows and columns of an area.
#pragma once

#include <algorithm>

namespace maquette {

struct Tiling {
  int columns = 0, rows = 0;
  int width = 0, height = 0;  // of one image
};

// Returns the tiling that shows `count` images of the ratio `image_width` : `image_height` largest in an area.
inline Tiling tile(int count, int area_width, int area_height, int image_width, int image_height) {
  Tiling best;
  for (int columns = count; columns >= 1; --columns) {
    const int rows = (count + columns - 1) / columns;
    const int cell_width = area_width / columns, cell_height = area_height / rows;
    const double scale =
        std::min(double(cell_width) / std::max(1, image_width), double(cell_height) / std::max(1, image_height));
    const int width = int(image_width * scale + 0.5);
    if (width > best.width) best = {columns, rows, width, int(image_height * scale + 0.5)};
  }
  return best;
}

}  // namespace maquette
