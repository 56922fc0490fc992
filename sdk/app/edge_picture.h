// How edges are drawn, by windows and by the command line: layers of a field in colours, the colours of curves, and the
// lines of a box. Draws with no library of graphics.
#pragma once

#include <array>
#include <maquette/maquette.hpp>
#include <vector>

#include "app/rgba_image.h"

namespace maquette {

struct Rgb {
  uint8_t r, g, b;
};

constexpr Rgb kCornerColour{255, 80, 80}, kBoxColour{255, 120, 255};

// Kinds of curves, as a legend has them.
enum class EdgeGroup { kConvex, kConcave, kBoundary };
constexpr std::array<const char*, 3> kEdgeGroupNames = {"convex crease", "concave crease", "boundary"};
constexpr std::array<Rgb, 3> kEdgeGroupColours = {Rgb{255, 235, 60}, Rgb{90, 255, 90}, Rgb{255, 255, 255}};
// A crease of unknown convexity counts as convex.
EdgeGroup group_of(const maq_edges_curve& curve);

enum class EdgeLayer {
  kDepth,     // near is red, far is blue, shaded; without the nearest and the farthest 2 %, which may be faults
  kDistance,  // to the nearest edge: 0 is red, eps_r and more blue
  kPlain      // the surface in grey, as if light came from the upper left
};
constexpr std::array<const char*, 3> kEdgeLayerNames = {"depth", "distance", "plain"};

// Draws an image of the field's size, one pixel for each value; black where depth is unknown. `picture` keeps its
// memory.
void draw_edge_layer(const EdgesResult& result, EdgeLayer layer, RgbaImage* picture);

using Point3 = std::array<double, 3>;  // metres, of the camera: x right, y down, z ahead
using Pixel = std::array<double, 2>;   // (0, 0) is the middle of the first

// Where a point is seen, which must be ahead of the camera (z > 0).
inline Pixel pixel_of(const maq_intrinsics& camera, const double* point_m) {
  return {camera.fx_px * point_m[0] / point_m[2] + camera.cx_px, camera.fy_px * point_m[1] / point_m[2] + camera.cy_px};
}

struct BoxLines {
  std::array<std::array<Point3, 2>, 12> edges;  // four along each side, in the order of the sides
  std::array<Point3, 3> labels;                 // of each side: the middle of the edge that is nearest to the camera
};
BoxLines lines_of(const maq_edges_box& box);

}  // namespace maquette
