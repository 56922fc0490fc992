// Images of one shape beside and below each other.
#pragma once

#include <algorithm>

namespace maquette {

struct Tiling {
  int columns = 0, rows = 0;
  int width = 0, height = 0;  // of an image
};

// As large as `count` images of `picture_width` : `picture_height` get in an area.
inline Tiling tile(int count, int area_width, int area_height, int picture_width, int picture_height) {
  Tiling best;
  for (int columns = count; columns >= 1; --columns) {
    const int rows = (count + columns - 1) / columns;
    const int cell_width = area_width / columns, cell_height = area_height / rows;
    const double scale =
        std::min(double(cell_width) / std::max(1, picture_width), double(cell_height) / std::max(1, picture_height));
    const int width = int(picture_width * scale + 0.5);
    if (width > best.width) best = {columns, rows, width, int(picture_height * scale + 0.5)};
  }
  return best;
}

}  // namespace maquette
