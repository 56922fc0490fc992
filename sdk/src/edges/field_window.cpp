#include "edges/field_window.h"

#include <algorithm>
#include <utility>

#include "core/rounding.h"

namespace maq {
namespace {

constexpr int kWindowMargin_px = 16 + 16;  // eps_r, of surfaces that face the camera; and context

// A half of `whole`, or all of it, that holds [begin, end) and its surroundings; it may end behind `whole`.
std::pair<int, int> part_of(int begin, int end, int whole, int multiple) {
  begin = std::max(0, begin - kWindowMargin_px) / multiple * multiple;
  const int half = round_up(divide_up(whole, 2), multiple), padded = round_up(whole, multiple);
  if (std::min(end + kWindowMargin_px, whole) - begin > half) return {0, padded};
  return {std::min(begin, padded - half), half};
}

}  // namespace

void FieldBounds::add(int left, int top, int right, int bottom) {
  left_px = std::min(left_px, left);
  top_px = std::min(top_px, top);
  right_px = std::max(right_px, right);
  bottom_px = std::max(bottom_px, bottom);
}

FieldWindow window_around(const FieldBounds& bounds, int width_px, int height_px, int multiple_px) {
  if (bounds.right_px == 0) return {};
  const auto [x, width] = part_of(bounds.left_px, bounds.right_px, width_px, multiple_px);
  const auto [y, height] = part_of(bounds.top_px, bounds.bottom_px, height_px, multiple_px);
  return {x, y, width, height};
}

}  // namespace maq
