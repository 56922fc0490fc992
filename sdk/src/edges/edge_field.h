// The distance-to-feature field of a depth frame: how far each pixel's point is from the nearest sharp feature curve.
//
// Lengths are in footprints, r = depth / focal length: metres between neighbouring pixels of a surface that faces the
// camera at that depth (DEF, arXiv 2011.15081, where they are sampling distances).
#pragma once

#include <cstdint>
#include <vector>

#include "image/geometry/intrinsics.h"

namespace maq {

enum EdgeKind : uint8_t {
  kNoEdge = 0,        // no edge within eps_r
  kCreaseEdge = 1,    // both adjacent surfaces are visible
  kBoundaryEdge = 2,  // one of them is hidden
};

// Planes have width * height values, row by row without padding.
struct EdgeField {
  int width = 0, height = 0;
  std::vector<float> distance_r;        // 0 to eps_r; eps_r: farther, or depth is unknown
  std::vector<float> expected_error_r;  // predicted mean absolute error of distance_r; eps_r where depth is unknown
  std::vector<uint8_t> kind;            // an EdgeKind
  std::vector<float> depth_m;           // along the optical axis; 0: unknown
  Intrinsics intrinsics;
  float eps_r = 0;
};

}  // namespace maq
