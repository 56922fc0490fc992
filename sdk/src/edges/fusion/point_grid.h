// Points of many views gathered in the cells of a grid: one point and normal a cell.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/math/vec3.h"

namespace maq {

// Sums are of whole numbers, so that the order in which points come has no effect at all. Memory is that of cells with
// points in them, some 60 bytes each.
class PointGrid {
 public:
  enum class Added { kYes, kOutside, kFull };

  struct Cell {
    uint64_t key;                     // its place: cells in the order of keys are in the order of z, y, x
    std::array<int64_t, 3> offset{};  // sum over points, 1/kFine of a cell from its corner
    std::array<int32_t, 3> normal{};  // sum, kFine a unit vector
    uint32_t count = 0;
    float r_m = 0;  // the smallest
  };

  // `limit`: of cells. A cell is `cell_m` wide; the grid reaches a million cells from the origin to each side.
  PointGrid(double cell_m, size_t limit);

  // A point from the origin, its surface's normal of length 1, and its footprint.
  Added add(Vec3 point, Vec3 normal, double r_m);

  // In the order of their keys. The grid is not to be used any more but for these.
  const std::vector<Cell>& sorted();
  Vec3 point(const Cell& cell) const;
  // Not of length 1: as long as the normals of the cell's points agree, 0 to 1.
  Vec3 normal(const Cell& cell) const;

 private:
  Cell* find_or_add(uint64_t key);
  void rebuild(size_t slots);

  double cell_m_;
  size_t limit_;
  std::vector<Cell> cells_;
  std::vector<uint32_t> slots_;  // hash table: 0, or one more than the index of a cell
};

}  // namespace maq
