// Tests whether a mesh of triangles is closed and manifold, and measures it.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "head/mesh/head_mesh.h"

struct MeshFacts {
  bool is_closed = true;    // each side belongs to two triangles, which run along it in opposite directions
  bool is_manifold = true;  // the triangles around each vertex form one fan
  int euler = 0;
  int pieces = 0;
  double volume = 0, area = 0, smallest_area = 1e300;
};

inline MeshFacts facts_of(const maq::head::HeadMesh& mesh) {
  MeshFacts facts;
  std::map<std::pair<uint32_t, uint32_t>, int> sides;
  std::vector<std::map<uint32_t, uint32_t>> fans(mesh.vertex_count());
  std::vector<size_t> parents(mesh.vertex_count());
  for (size_t i = 0; i < parents.size(); ++i) parents[i] = i;
  const auto root = [&](size_t i) {
    while (parents[i] != i) i = parents[i] = parents[parents[i]];
    return i;
  };
  for (size_t i = 0; i < mesh.triangle_count(); ++i) {
    const uint32_t* const t = &mesh.triangles[3 * i];
    std::array<std::array<double, 3>, 3> p{};
    for (size_t k = 0; k < 3; ++k) {
      ++sides[{t[k], t[(k + 1) % 3]}];
      if (!fans[t[k]].emplace(t[(k + 1) % 3], t[(k + 2) % 3]).second) facts.is_manifold = false;
      parents[root(t[k])] = root(t[0]);
      for (size_t axis = 0; axis < 3; ++axis) p[k][axis] = double(mesh.positions[3 * t[k] + axis]);
    }
    double normal[3];
    for (size_t axis = 0; axis < 3; ++axis) {
      const size_t a = (axis + 1) % 3, b = (axis + 2) % 3;
      normal[axis] = (p[1][a] - p[0][a]) * (p[2][b] - p[0][b]) - (p[1][b] - p[0][b]) * (p[2][a] - p[0][a]);
      facts.volume += normal[axis] * p[0][axis] / 6;
    }
    const double area = std::sqrt(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]) / 2;
    facts.area += area;
    facts.smallest_area = std::min(facts.smallest_area, area);
  }
  for (const auto& [side, count] : sides) {
    if (count != 1 || sides.count({side.second, side.first}) == 0) facts.is_closed = false;
  }
  std::set<size_t> roots;
  for (size_t i = 0; i < fans.size(); ++i) {
    roots.insert(root(i));
    if (fans[i].empty()) {
      facts.is_manifold = false;
      continue;
    }
    size_t steps = 0;
    uint32_t at = fans[i].begin()->first;
    do {
      const auto next = fans[i].find(at);
      if (next == fans[i].end()) break;
      at = next->second;
    } while (++steps < fans[i].size() && at != fans[i].begin()->first);
    if (steps != fans[i].size() || at != fans[i].begin()->first) facts.is_manifold = false;
  }
  facts.pieces = int(roots.size());
  facts.euler = int(mesh.vertex_count()) - int(sides.size() / 2) + int(mesh.triangle_count());
  return facts;
}
