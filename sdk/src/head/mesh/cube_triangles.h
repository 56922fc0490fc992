// Which triangles marching cubes puts into a cell, for each of the 256 ways in which its corners lie inside or outside.
//
// On a face with alternating corners, the inside corners are separated. The rule depends only on the face, so both of
// its cells agree (Nielson and Hamann 1991 decide it by the values instead). Each cell's segments on its faces form
// loops, and only these segments join two points of one face. So each side belongs to exactly two triangles: two of one
// cell, or one of each cell of a face. All 256 cells have such triangles, at most five (tests/native/head).
#pragma once

#include <array>
#include <cstdint>

namespace maq::head {

// Corner c of a cell lies at (c & 1, c >> 1 & 1, c >> 2 & 1). Edge e runs along axis e / 4 from the corner that is
// e & 1 along the next axis, and e >> 1 & 1 along the one after that (x after z).
struct CubeTriangles {
  int count = 0;
  std::array<uint8_t, 15> edges{};  // three to a triangle, counter-clockwise seen from outside
};

// By a number whose bit c says that corner c is inside.
const std::array<CubeTriangles, 256>& cube_triangles();

// The corner where an edge begins; it ends at that corner + (1 << edge / 4).
constexpr int first_corner(int edge) {
  const int axis = edge / 4, next = (axis + 1) % 3, last = (axis + 2) % 3;
  return (edge & 1) << next | (edge >> 1 & 1) << last;
}

}  // namespace maq::head
