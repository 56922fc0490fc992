// Which splats each tile of an image has, from front to back.
#pragma once

#include <cstdint>
#include <vector>

#include "core/worker_threads.h"
#include "scene/splats/splat_projection.h"

namespace maq {

// Columns of tiles [first, end) that the splat reaches within a row of tiles.
struct TileColumns {
  int first, end;
};
TileColumns columns_in_row(const ProjectedSplat& splat, int tile_row);

// Sorts splats by depth, then shares them out to tiles. Splats of one depth keep their order, so that the result is the
// same with any number of threads.
class SplatTiles {
 public:
  // Begins an image with those splats: `spans` of `splats`, [first, end) each.
  void sort(const ProjectedSplat* splats, const std::vector<std::pair<uint32_t, uint32_t>>& spans, int columns,
            int rows, WorkerThreads& threads);

  uint64_t sorted_count() const { return order_.size(); }

  // Makes lists for the tiles from the first one without, row by row, as many as memory is meant for. False when all
  // have had theirs.
  bool fill_next(WorkerThreads& threads);
  int first_tile() const { return first_tile_; }
  int end_tile() const { return end_tile_; }
  // Indices of the splats of a tile of [first_tile, end_tile), from front to back.
  const uint32_t* begin_of(int tile) const { return lists_.data() + starts_[size_t(tile - first_tile_)]; }
  const uint32_t* end_of(int tile) const { return lists_.data() + starts_[size_t(tile - first_tile_) + 1]; }

 private:
  void sort_by_depth(WorkerThreads& threads);
  void count(WorkerThreads& threads);

  struct DepthEntry {
    uint32_t key, index;
    TileRectangle tiles;
  };
  const ProjectedSplat* splats_ = nullptr;
  int columns_ = 0, rows_ = 0, first_tile_ = 0, end_tile_ = 0;
  std::vector<DepthEntry> order_, swapped_;
  std::vector<uint32_t> counts_;  // [part][tile]: first how many splats, then where the part's begin
  std::vector<uint64_t> totals_;  // of each tile
  std::vector<size_t> starts_;
  std::vector<uint32_t> lists_;
  std::vector<std::vector<uint32_t>> digits_;
};

}  // namespace maq
