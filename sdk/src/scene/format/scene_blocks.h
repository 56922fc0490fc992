// Cutting a cloud into small boxes of neighbouring points.
#pragma once

#include <cstdint>
#include <vector>

#include "scene/point_cloud.h"

namespace maq {

// Points in the order of their blocks: block k is order[ends[k - 1] .. ends[k]), in it by index.
struct BlockOrder {
  std::vector<uint32_t> order;
  std::vector<uint32_t> ends;
};

// Adds blocks of the points with indices `chosen`, halved across their longest side until no block has over `most_points`; all but one
// block are full. Then a block is cut where there is a gap of most of its length, so that a point far from all others
// does not make a large box of its neighbours' (at most four blocks are made of one). Places must be finite.
void cut_into_blocks(const PointPlaces& places, const std::vector<uint32_t>& chosen, uint32_t most_points,
                     BlockOrder& blocks);

}  // namespace maq
