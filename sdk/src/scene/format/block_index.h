// In which block of a scene a point is.
#pragma once

#include <cstdint>
#include <vector>

#include "scene/format/scene.h"

namespace maq {

class BlockIndex {
 public:
  explicit BlockIndex(const Scene& scene) : blocks_(scene.blocks) {
    for (uint32_t block = 0; block < scene.block_count; ++block) {
      // The first block that begins in or before each chunk, and ends behind its begin.
      const uint32_t end = blocks_[block].first + blocks_[block].count;
      while (uint64_t(chunks_.size()) << kChunkBits < end) chunks_.push_back(block);
    }
  }

  // Blocks that are full are found in at most two steps; the smallest in as many as a chunk has points.
  uint32_t block_of(uint32_t point) const {
    uint32_t block = chunks_[point >> kChunkBits];
    while (point - blocks_[block].first >= blocks_[block].count) ++block;
    return block;
  }

 private:
  static constexpr uint32_t kChunkBits = 8;
  const SceneBlock* blocks_;
  std::vector<uint32_t> chunks_;
};

}  // namespace maq
