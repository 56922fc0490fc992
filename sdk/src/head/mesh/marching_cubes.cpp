#include "head/mesh/marching_cubes.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "core/error.h"
#include "head/mesh/cube_triangles.h"

namespace maq::head {
namespace {

using Index3 = std::array<int, 3>;

constexpr int kTopSide = 32;  // cells of the first blocks' sides; the last have 2
constexpr uint32_t kNone = std::numeric_limits<uint32_t>::max();

// Values at points of the grid and vertices on its edges, in bricks of 8 x 8 x 8 points that exist once they are
// touched.
class SparseGrid {
 public:
  explicit SparseGrid(const Index3& cells) {
    for (size_t axis = 0; axis < 3; ++axis) bricks_[axis] = size_t(cells[axis]) / 8 + 1;
    table_.assign(bricks_[0] * bricks_[1] * bricks_[2], kNone);
  }

  // NaN: not known.
  float& value(const Index3& at) {
    uint32_t& brick = table_[brick_of(at)];
    if (brick == kNone) {
      brick = uint32_t(values_.size() / kBrick);
      values_.resize(values_.size() + kBrick, std::numeric_limits<float>::quiet_NaN());
      edge_bricks_.push_back(kNone);
    }
    return values_[brick * kBrick + place_of(at)];
  }

  // The vertex on the edge from a point along an axis; kNone: there is none yet. The point has a value.
  uint32_t& vertex(const Index3& at, int axis) {
    uint32_t& brick = edge_bricks_[table_[brick_of(at)]];
    if (brick == kNone) {
      brick = uint32_t(vertices_.size() / (3 * kBrick));
      vertices_.resize(vertices_.size() + 3 * kBrick, kNone);
    }
    return vertices_[brick * 3 * kBrick + 3 * place_of(at) + size_t(axis)];
  }

 private:
  static constexpr size_t kBrick = 512;

  size_t brick_of(const Index3& at) const {
    return (size_t(at[2] >> 3) * bricks_[1] + size_t(at[1] >> 3)) * bricks_[0] + size_t(at[0] >> 3);
  }
  static size_t place_of(const Index3& at) { return size_t((at[2] & 7) << 6 | (at[1] & 7) << 3 | (at[0] & 7)); }

  std::array<size_t, 3> bricks_{};
  std::vector<uint32_t> table_, edge_bricks_;
  std::vector<float> values_;
  std::vector<uint32_t> vertices_;
};

// A vertex on an edge of the grid: where the field changes its sign between two fractions of the edge.
struct EdgeVertex {
  Index3 from{};
  int axis = 0, last_side = 0;
  double low = 0, high = 1, low_value = 0, high_value = 0, fraction = 0;
};

// Interpolates linearly between the two values, inside of the edge.
void interpolate(EdgeVertex& vertex) {
  const double share = vertex.low_value / (vertex.low_value - vertex.high_value);
  const double found = vertex.low + share * (vertex.high - vertex.low);
  vertex.fraction = std::clamp(std::isfinite(found) ? found : 0.5, kMinFraction, 1 - kMinFraction);
}

// The secant method's next bracket; the end that stays twice counts half (Illinois).
void narrow(EdgeVertex& vertex, double value) {
  const bool is_low = (value < 0) == (vertex.low_value < 0);
  const int side = is_low ? -1 : 1;
  if (is_low) {
    vertex.low = vertex.fraction, vertex.low_value = value;
    if (vertex.last_side == side) vertex.high_value /= 2;
  } else {
    vertex.high = vertex.fraction, vertex.high_value = value;
    if (vertex.last_side == side) vertex.low_value /= 2;
  }
  vertex.last_side = side;
  interpolate(vertex);
}

class SurfaceFinder {
 public:
  SurfaceFinder(const ScalarField& field, const MarchingCubesOptions& options, const Index3& cells,
                WorkerThreads& threads)
      : field_(field), options_(options), cells_(cells), threads_(threads), grid_(cells) {
    for (size_t axis = 0; axis < 3; ++axis) blocks_[axis] = size_t(cells[axis]) / 2;
    is_active_.resize(blocks_[0] * blocks_[1] * blocks_[2]);
  }

  HeadMesh find() {
    find_blocks();
    evaluate_blocks(0);
    for (size_t begin = 0, end = active_.size(); begin < end; begin = end, end = active_.size()) {
      for (size_t i = begin; i < end; ++i) add_neighbours(Index3(active_[i]));
      evaluate_blocks(end);
    }
    for (const Index3& block : active_) add_triangles(block);
    for (int step = 0; step < options_.refine_steps; ++step) refine();
    mesh_.positions.reserve(3 * vertices_.size());
    for (const EdgeVertex& vertex : vertices_) {
      const auto position = position_of(vertex);
      mesh_.positions.insert(mesh_.positions.end(), position.begin(), position.end());
    }
    return std::move(mesh_);
  }

  size_t evaluations() const { return evaluations_; }

 private:
  float coordinate(size_t axis, double index) const {
    return float(options_.box_min[axis] + index * double(options_.cell));
  }

  std::array<float, 3> position_of(const EdgeVertex& vertex) const {
    std::array<float, 3> position{};
    for (size_t axis = 0; axis < 3; ++axis) {
      const double add = int(axis) == vertex.axis ? vertex.fraction : 0;
      position[axis] = coordinate(axis, vertex.from[axis] + add);
    }
    return position;
  }

  // The field and the box, whose border is outside, at points given one by one.
  template <class PositionOf>
  void evaluate(size_t count, std::vector<float>& values, PositionOf&& position) {
    values.resize(count);
    evaluations_ += count;
    threads_.run((count + kFieldBatch - 1) / kFieldBatch, [&](size_t batch, int) {
      const size_t begin = batch * kFieldBatch, size = std::min(kFieldBatch, count - begin);
      std::vector<float> axes(3 * size);
      for (size_t i = 0; i < size; ++i) {
        const std::array<float, 3> at = position(begin + i);
        for (size_t axis = 0; axis < 3; ++axis) axes[axis * size + i] = at[axis];
      }
      float* const found = values.data() + begin;
      field_(axes.data(), axes.data() + size, axes.data() + 2 * size, found, size);
      for (size_t i = 0; i < size; ++i) {
        if (!std::isfinite(found[i])) {
          throw Error(MAQ_ERROR_INVALID_ARGUMENT, "The field is ", found[i], " at (", axes[i], ", ", axes[size + i],
                      ", ", axes[2 * size + i],
                      "), where its surface was looked for. Check the weights that it is made of.");
        }
        for (size_t axis = 0; axis < 3; ++axis) {
          const float at = axes[axis * size + i];
          found[i] = std::max({found[i], options_.box_min[axis] - at, at - options_.box_max[axis]});
        }
      }
    });
  }

  void evaluate_points(const std::vector<Index3>& points, std::vector<float>& values) {
    points_ += points.size();
    if (points_ > options_.max_points) {
      throw Error(MAQ_ERROR_OUT_OF_MEMORY, "The surface passes near more than ", options_.max_points,
                  " points of the grid. Choose larger cells or a smaller box.");
    }
    evaluate(points.size(), values, [&](size_t i) {
      const Index3& at = points[i];
      return std::array<float, 3>{coordinate(0, at[0]), coordinate(1, at[1]), coordinate(2, at[2])};
    });
    // Zero is outside; so is the border, where rounding could leave a point inside of the box.
    for (size_t i = 0; i < points.size(); ++i) {
      for (size_t axis = 0; axis < 3; ++axis) {
        if (points[i][axis] <= 0 || points[i][axis] >= cells_[axis]) values[i] = std::max(values[i], 0.0f);
      }
    }
  }

  // Refines large blocks to blocks of two cells: a block is kept if the value at its centre allows a piece of the
  // surface. The centres are points of the grid, so no value is lost.
  void find_blocks() {
    std::vector<Index3> blocks, kept, centres;
    std::vector<float> values;
    for (int z = 0; z < cells_[2]; z += kTopSide) {
      for (int y = 0; y < cells_[1]; y += kTopSide) {
        for (int x = 0; x < cells_[0]; x += kTopSide) blocks.push_back({x, y, z});
      }
    }
    for (int side = kTopSide;; side /= 2) {
      const int half = side / 2;
      centres.clear();
      for (const Index3& block : blocks) centres.push_back({block[0] + half, block[1] + half, block[2] + half});
      evaluate_points(centres, values);
      // The box is a distance itself, of slope 1. The last bits of coordinates may make a value differ a little more.
      const double reach = 1.001 * std::sqrt(3.0) * half * double(options_.cell) * std::max(1.0f, options_.max_slope);
      kept.clear();
      for (size_t i = 0; i < blocks.size(); ++i) {
        if (std::abs(double(values[i])) > reach) continue;
        if (is_in_grid(centres[i])) grid_.value(centres[i]) = values[i];
        if (side == 2) {
          activate(blocks[i]);
          continue;
        }
        for (int child = 0; child < 8; ++child) {
          const Index3 at = {blocks[i][0] + (child & 1) * half, blocks[i][1] + (child >> 1 & 1) * half,
                             blocks[i][2] + (child >> 2) * half};
          if (at[0] < cells_[0] && at[1] < cells_[1] && at[2] < cells_[2]) kept.push_back(at);
        }
      }
      if (side == 2) break;
      blocks.swap(kept);
    }
  }

  bool is_in_grid(const Index3& at) const { return at[0] <= cells_[0] && at[1] <= cells_[1] && at[2] <= cells_[2]; }

  void activate(const Index3& block) {
    for (size_t axis = 0; axis < 3; ++axis) {
      if (block[axis] < 0 || block[axis] >= cells_[axis]) return;
    }
    auto flag =
        is_active_.begin() +
        std::ptrdiff_t((size_t(block[2] / 2) * blocks_[1] + size_t(block[1] / 2)) * blocks_[0] + size_t(block[0] / 2));
    if (*flag) return;
    *flag = true;
    active_.push_back(block);
  }

  // All corners of the active blocks from the one numbered `begin`.
  void evaluate_blocks(size_t begin) {
    constexpr float kPending = std::numeric_limits<float>::infinity();
    std::vector<Index3> points;
    std::vector<float> values;
    for (size_t i = begin; i < active_.size(); ++i) {
      for (int corner = 0; corner < 27; ++corner) {
        const Index3 at = corner_of(active_[i], corner);
        float& value = grid_.value(at);
        if (!std::isnan(value)) continue;
        value = kPending;
        points.push_back(at);
      }
      if (points.size() > options_.max_points) break;  // evaluate_points() says so
    }
    evaluate_points(points, values);
    for (size_t i = 0; i < points.size(); ++i) grid_.value(points[i]) = values[i];
  }

  static Index3 corner_of(const Index3& block, int corner) {
    return {block[0] + corner % 3, block[1] + corner / 3 % 3, block[2] + corner / 9};
  }

  // Adds the neighbours that continue the surface of a block.
  void add_neighbours(const Index3& block) {
    std::array<bool, 27> is_inside{};
    for (int corner = 0; corner < 27; ++corner) is_inside[size_t(corner)] = grid_.value(corner_of(block, corner)) < 0;
    if (std::all_of(is_inside.begin(), is_inside.end(), [&](bool is) { return is == is_inside[0]; })) return;
    constexpr int kStrides[3] = {1, 3, 9};
    for (int axis = 0; axis < 3; ++axis) {
      const int u = kStrides[(axis + 1) % 3], v = kStrides[(axis + 2) % 3];
      for (int side = 0; side < 2; ++side) {
        int inside = 0;
        for (int i = 0; i < 9; ++i) inside += is_inside[size_t(side * 2 * kStrides[axis] + i % 3 * u + i / 3 * v)];
        if (inside == 0 || inside == 9) continue;
        Index3 neighbour = block;
        neighbour[size_t(axis)] += side == 0 ? -2 : 2;
        activate(neighbour);
      }
    }
  }

  void add_triangles(const Index3& block) {
    float values[27];
    int inside = 0;
    for (int corner = 0; corner < 27; ++corner) {
      values[corner] = grid_.value(corner_of(block, corner));
      inside += values[corner] < 0;
    }
    if (inside == 0 || inside == 27) return;
    for (int cell = 0; cell < 8; ++cell) {
      const int base = (cell & 1) + (cell >> 1 & 1) * 3 + (cell >> 2) * 9;
      const Index3 at = corner_of(block, base);
      float corners[8];
      int number = 0;
      for (int corner = 0; corner < 8; ++corner) {
        corners[corner] = values[base + (corner & 1) + (corner >> 1 & 1) * 3 + (corner >> 2) * 9];
        number |= int(corners[corner] < 0) << corner;
      }
      const CubeTriangles& triangles = cube_triangles()[size_t(number)];
      for (int i = 0; i < 3 * triangles.count; ++i) {
        const int edge = triangles.edges[size_t(i)], axis = edge / 4, first = first_corner(edge);
        const Index3 from = {at[0] + (first & 1), at[1] + (first >> 1 & 1), at[2] + (first >> 2)};
        uint32_t& vertex = grid_.vertex(from, axis);
        if (vertex == kNone) {
          vertex = uint32_t(vertices_.size());
          EdgeVertex made;
          made.from = from, made.axis = axis;
          made.low_value = double(corners[first]), made.high_value = double(corners[first | 1 << axis]);
          interpolate(made);
          vertices_.push_back(made);
        }
        mesh_.triangles.push_back(vertex);
      }
    }
  }

  void refine() {
    std::vector<float> values;
    evaluate(vertices_.size(), values, [&](size_t i) { return position_of(vertices_[i]); });
    for (size_t i = 0; i < vertices_.size(); ++i) narrow(vertices_[i], double(values[i]));
  }

  const ScalarField& field_;
  const MarchingCubesOptions& options_;
  Index3 cells_;
  WorkerThreads& threads_;
  SparseGrid grid_;
  std::array<size_t, 3> blocks_{};
  std::vector<bool> is_active_;
  std::vector<Index3> active_;
  std::vector<EdgeVertex> vertices_;
  HeadMesh mesh_;
  size_t evaluations_ = 0, points_ = 0;
};

// Even, so that blocks of two cells fill the grid; the last layer may lie outside of the box.
Index3 count_cells(const MarchingCubesOptions& options) {
  Index3 cells{};
  double farthest = 0;
  for (size_t axis = 0; axis < 3; ++axis) {
    const double low = double(options.box_min[axis]), high = double(options.box_max[axis]);
    if (!std::isfinite(low) || !std::isfinite(high) || !(high > low)) {
      throw Error(MAQ_ERROR_INVALID_ARGUMENT, "The box of the surface goes from ", low, " to ", high,
                  " along one axis. Give a box whose numbers are finite and whose sides are positive.");
    }
    farthest = std::max({farthest, std::abs(low), std::abs(high)});
  }
  const double cell = double(options.cell);
  if (!std::isfinite(cell) || !(cell > 0) || cell < 1e-4 * farthest) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "The cells of the surface have a size of ", cell,
                ". Give a positive one, not below a ten-thousandth of the coordinates, which reach to ", farthest, ".");
  }
  for (size_t axis = 0; axis < 3; ++axis) {
    const double count = std::ceil((double(options.box_max[axis]) - double(options.box_min[axis])) / cell - 1e-6);
    if (count > kMaxCellsPerAxis) {
      throw Error(MAQ_ERROR_INVALID_ARGUMENT, "The surface's grid would have ", count, " cells along one axis, but ",
                  kMaxCellsPerAxis, " is the limit. Choose larger cells or a smaller box.");
    }
    cells[axis] = (std::max(1, int(count)) + 1) / 2 * 2;
  }
  return cells;
}

}  // namespace

HeadMesh marching_cubes(const ScalarField& field, const MarchingCubesOptions& options, WorkerThreads& threads,
                        MarchingCubesStats* stats) {
  if (!std::isfinite(options.max_slope) || !(options.max_slope > 0) || options.refine_steps < 0) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "The field's largest slope is given as ", options.max_slope, ", with ",
                options.refine_steps, " steps of refinement. Give a positive slope and no negative number of steps.");
  }
  const Index3 cells = count_cells(options);
  SurfaceFinder finder(field, options, cells, threads);
  HeadMesh mesh = finder.find();
  if (stats != nullptr) {
    stats->grid_points = size_t(cells[0] + 1) * size_t(cells[1] + 1) * size_t(cells[2] + 1);
    stats->evaluations = finder.evaluations();
  }
  return mesh;
}

}  // namespace maq::head
