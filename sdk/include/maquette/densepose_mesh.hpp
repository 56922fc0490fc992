// The body that labels lie on (maq_densepose_surface), as triangles to draw and as a texture to sample. For C++17, in this header alone.
#ifndef MAQUETTE_DENSEPOSE_MESH_HPP_
#define MAQUETTE_DENSEPOSE_MESH_HPP_

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "maquette/maquette.hpp"

namespace maquette {

struct DensePoseMesh {
  struct Vertex {
    std::array<float, 3> point_m;  // x to the body's left, y to its back, z up
    std::array<float, 3> normal;   // of any length and either side, not 0
    float part, u, v;              // part - 1, 0 to 23; U and V, 0 to 1
  };
  std::vector<Vertex> triangles;  // three each
  // [24][nodes along V][nodes along U][3], metres: where a chart does not reach its nearest point goes on, so that what lies
  // between two nodes is always known.
  std::vector<float> filled_points_m;
  int nodes = 0;

  // `points_m` [24][nodes along U][nodes along V][3], as in maq_densepose_surface.
  DensePoseMesh(const std::vector<float>& points_m, int nodes_a_side) : nodes(nodes_a_side) {
    const Grid grid{points_m, nodes};
    for (int part = 0; part < 24; ++part) {
      fill(grid, part);
      for (int u = 0; u + 1 < nodes; ++u) {
        for (int v = 0; v + 1 < nodes; ++v) add_cell(grid, part, u, v);
      }
    }
  }

 private:
  struct Grid {
    const std::vector<float>& points_m;
    int nodes;

    const float* at(int part, int u, int v) const { return &points_m[3 * size_t((part * nodes + u) * nodes + v)]; }
    bool is_known(int part, int u, int v) const { return !std::isnan(at(part, u, v)[0]); }
  };

  void fill(const Grid& grid, int part) {
    for (int v = 0; v < nodes; ++v) {
      for (int u = 0; u < nodes; ++u) {
        const float* nearest = grid.at(part, u, v);
        int least = grid.is_known(part, u, v) ? 0 : std::numeric_limits<int>::max();
        for (int other_u = 0; least != 0 && other_u < nodes; ++other_u) {
          for (int other_v = 0; other_v < nodes; ++other_v) {
            const int away = (other_u - u) * (other_u - u) + (other_v - v) * (other_v - v);
            if (away >= least || !grid.is_known(part, other_u, other_v)) continue;
            nearest = grid.at(part, other_u, other_v);
            least = away;
          }
        }
        filled_points_m.insert(filled_points_m.end(), nearest, nearest + 3);
      }
    }
  }

  // Two triangles of the cell's corners 0 1 / 2 3, or one where a corner is unknown.
  void add_cell(const Grid& grid, int part, int u, int v) {
    constexpr int kOneWay[2][3] = {{0, 1, 2}, {1, 3, 2}}, kOtherWay[2][3] = {{0, 1, 3}, {0, 3, 2}};
    const auto known = [&](int corner) { return grid.is_known(part, u + (corner & 1), v + (corner >> 1)); };
    for (const auto& triangle : known(1) && known(2) ? kOneWay : kOtherWay) {
      if (!known(triangle[0]) || !known(triangle[1]) || !known(triangle[2])) continue;
      for (const int corner : triangle) triangles.push_back(vertex(grid, part, u + (corner & 1), v + (corner >> 1)));
    }
  }

  Vertex vertex(const Grid& grid, int part, int u, int v) const {
    const float* const here = grid.at(part, u, v);
    const auto along = [&](int du, int dv) {
      const int u1 = std::min(u + du, nodes - 1), v1 = std::min(v + dv, nodes - 1);
      const int u0 = std::max(u - du, 0), v0 = std::max(v - dv, 0);
      const float* const after = grid.is_known(part, u1, v1) ? grid.at(part, u1, v1) : here;
      const float* const before = grid.is_known(part, u0, v0) ? grid.at(part, u0, v0) : here;
      return std::array<float, 3>{after[0] - before[0], after[1] - before[1], after[2] - before[2]};
    };
    const std::array<float, 3> a = along(1, 0), b = along(0, 1);
    std::array<float, 3> normal{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
    // Where the chart shrinks to a line there is none.
    if (!(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2] > 0)) normal = {0, -1, 0};
    return {{here[0], here[1], here[2]}, normal, float(part), float(u) / float(nodes - 1), float(v) / float(nodes - 1)};
  }
};

}  // namespace maquette

#endif  // MAQUETTE_DENSEPOSE_MESH_HPP_
