#include "scene/format/scene.h"

#include <algorithm>
#include <limits>

namespace maq {

SceneBounds bounds_of(const Scene& scene) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  SceneBounds bounds{{kInfinity, kInfinity, kInfinity}, {-kInfinity, -kInfinity, -kInfinity}};
  for (size_t axis = 0; axis < 3; ++axis) {
    for (uint32_t b = 0; b < scene.block_count; ++b) {
      bounds.low[axis] = std::min(bounds.low[axis], scene.origin[axis] + double(scene.blocks[b].low[axis]));
      bounds.high[axis] = std::max(bounds.high[axis], scene.origin[axis] + double(scene.blocks[b].high[axis]));
    }
  }
  return bounds;
}

}  // namespace maq
