// Gathers points of many views in the cells of a grid: one point and normal for each cell.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/math/vec3.h"

namespace maq {

// Sums are whole numbers, so that the order of points has no effect. Only cells with points take memory, about 60 bytes
// each.
class PointGrid {
 public:
  enum class Added { kYes, kOutside, kFull };

  struct Cell {
    uint64_t key;                     // its position; the order of keys is the order of z, y, x
    std::array<int64_t, 3> offset{};  // sum over points, 1/kFine of a cell from its corner
    std::array<int32_t, 3> normal{};  // sum, kFine a unit vector
    uint32_t count = 0;
    float r_m = 0;  // the smallest
  };

  // `limit`: maximum number of cells. A cell is `cell_m` wide; the grid reaches a million cells from the origin to each
  // side.
  PointGrid(double cell_m, size_t limit);

  // Adds a point relative to the origin, the normal of its surface (length 1), and its footprint.
  Added add(Vec3 point, Vec3 normal, double r_m);

  // Returns the cells in the order of their keys. Nothing can be added afterwards.
  const std::vector<Cell>& sorted();
  Vec3 point(const Cell& cell) const;
  // The mean normal. Its length, 0 to 1, shows how well the normals of the cell's points agree.
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
