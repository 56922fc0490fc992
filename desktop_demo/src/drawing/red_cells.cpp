#include "drawing/red_cells.h"

#include <imgui.h>
#include <algorithm>

void draw_red_cells(const std::vector<float>& bits, int columns, const Reddening& reddening, const Rect& picture) {
  if (bits.empty()) return;
  const int rows = int(bits.size()) / columns;
  ImDrawList* const list = ImGui::GetBackgroundDrawList();
  const auto colour = [&](int row, int column) {
    const float own =
        bits[size_t(std::clamp(row, 0, rows - 1)) * size_t(columns) + size_t(std::clamp(column, 0, columns - 1))];
    const float fullness = (own - reddening.from_bits) / (reddening.full_bits - reddening.from_bits);
    return IM_COL32(255, 0, 0, int(255 * reddening.max_red * std::clamp(fullness, 0.0f, 1.0f)));
  };
  // A line of the grid: the borders of the picture, and between them the middles.
  const auto at = [](int i, int count, int from, int length) {
    const float cell = std::clamp(float(i) - 0.5f, 0.0f, float(count));
    return float(from) + cell * float(length) / float(count);
  };
  for (int row = 0; row <= rows; ++row) {
    const float top = at(row, rows, picture.y, picture.height);
    const float bottom = at(row + 1, rows, picture.y, picture.height);
    for (int column = 0; column <= columns; ++column) {
      const float left = at(column, columns, picture.x, picture.width);
      const float right = at(column + 1, columns, picture.x, picture.width);
      list->AddRectFilledMultiColor({left, top}, {right, bottom}, colour(row - 1, column - 1), colour(row - 1, column),
                                    colour(row, column), colour(row, column - 1));
    }
  }
}
