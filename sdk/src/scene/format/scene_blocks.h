// Splits a cloud into small boxes of neighbouring points.
#pragma once

#include <cstdint>
#include <vector>

#include "scene/point_cloud.h"

namespace maq {

// Points in the order of their blocks: block k is order[ends[k - 1] .. ends[k]), sorted by index.
struct BlockOrder {
  std::vector<uint32_t> order;
  std::vector<uint32_t> ends;
};

// Adds blocks of the points with indices `chosen`: halved across the longest side (a k-d tree) until no block has over
// `max_points`; all but one block are full. Then a block is split where there is a gap of most of its length, so that a
// point far from all others does not enlarge its neighbours' box (at most four blocks are made of one). Positions must
// be finite.
void split_into_blocks(const PointPositions& positions, const std::vector<uint32_t>& chosen, uint32_t max_points,
                       BlockOrder& blocks);

}  // namespace maq
