// Finds the part of a depth frame that may have an edge: depth that is not flat within the sensor's noise.
//
// Noise is measured locally by second differences of inverse depth along rows: an edge affects few of them, white noise
// affects all. Noise that neighbours share is underestimated, which costs time but no edge.
#pragma once

#include <vector>

#include "core/worker_threads.h"
#include "edges/depth_slopes.h"

namespace maq {

class ActiveWindow {
 public:
  // The part for the network, with half or all of each side of the frame, in multiples of `multiple_px`: all areas of
  // 32 x 32 px that are not flat or have partly known depth, with a margin of eps_r and some context. No width: there
  // is none.
  FieldWindow find(const DepthPlane& depth, const Intrinsics& intrinsics, int multiple_px, WorkerThreads& threads);

 private:
  // Sums over a tile's pixels with depth: x and y from the tile's corner, q is inverse depth.
  struct Moments {
    double n = 0, x = 0, y = 0, xx = 0, xy = 0, yy = 0, q = 0, qx = 0, qy = 0, qq = 0;
    double bends = 0, bend_count = 0;  // sum of absolute second differences along rows
  };

  void sum_row_of_tiles(const DepthPlane& depth, int row);
  bool has_edge(int column, int row, double focal_px, int64_t pixels) const;

  int columns_ = 0, rows_ = 0;  // of tiles
  std::vector<Moments> tiles_;
};

}  // namespace maq
