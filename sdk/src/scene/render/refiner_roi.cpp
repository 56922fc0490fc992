#include "scene/render/refiner_roi.h"

#include <algorithm>

#include "core/rounding.h"

namespace maq {
namespace {

constexpr int kMultiple = DescriptorRaster::kMultiple;

struct Part {
  int begin, size;
};

Part part_of(int begin, int size, int whole) {
  const int first = std::max(0, begin - kReceptiveFieldRadius_px),
            end = std::min(whole, begin + size + kReceptiveFieldRadius_px);
  for (int quarters = 1; quarters < 4; ++quarters) {
    const int side = round_up(whole * quarters / 4, kMultiple);
    if (side < end - first) continue;
    const int centred = (first + end - side) / 2 / kMultiple * kMultiple;
    return {std::clamp(centred, std::max(0, end - side), std::min(first, whole - side)), side};
  }
  return {0, whole};
}

}  // namespace

RasterWindow window_to_refine(const RasterWindow& occupied, int width_px, int height_px) {
  const Part across = part_of(occupied.left_px, occupied.width_px, width_px);
  const Part down = part_of(occupied.top_px, occupied.height_px, height_px);
  const RasterWindow part{across.begin, down.begin, across.size, down.size};
  const bool is_worth_it = int64_t(4) * part.width_px * part.height_px <= int64_t(3) * width_px * height_px;
  return is_worth_it ? part : RasterWindow{0, 0, width_px, height_px};
}

}  // namespace maq
