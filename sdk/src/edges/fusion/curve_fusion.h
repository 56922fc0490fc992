// Fuses sharp feature curves of several posed views: curves side by side in space become one.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "edges/curves/arc_fit.h"
#include "edges/curves/corners.h"
#include "edges/curves/edge_curves.h"
#include "edges/curves/line_fit.h"
#include "edges/curves/spline_fit.h"
#include "image/geometry/pinhole_camera.h"

namespace maq {

// r: a footprint of the view that saw a curve.
struct CurveFusionOptions {
  double match_r = 3;        // curves of two views are one if they are this near
  double match_deg = 20;     // and have this direction in common
  double gap_r = 6;          // a curve continues over gaps of this length
  double tolerance_r = 1;    // the simplest type with this root mean square distance is taken
  double min_length_r = 10;  // shorter curves are dropped
  double join_r = 12;        // ends this near the point where their curves meet share a corner
  int min_views = 2;         // views a curve needs; with one or two views, one is enough
  int max_curves = 4096;     // the shortest beyond this number are dropped
};

class CurveFusion {
 public:
  explicit CurveFusion(const CurveFusionOptions& options = {}) : options_(options) {}

  // Adds the curves of a view, in the coordinates of its camera.
  void add_view(const EdgeCurves& curves, const PinholeCamera& pose);

  // Curves of all views, in the world; computations are relative to `origin`, which is amid the cameras. The order of
  // views has no effect but on rounding. Fused curves know no planes.
  void fuse(const std::array<double, 3>& origin, EdgeCurves& result) const;

 private:
  // A sample of a view's curve; the direction has length 1.
  struct Place {
    Vec3 point, direction;
    double r_m;
    int view;
    EdgeKind kind;
    Convexity convexity;
  };
  struct Piece {
    size_t first, count;  // of places_
    double length_r;
    bool is_closed;
  };
  class Merger;

  CurveFusionOptions options_;
  std::vector<std::array<double, 3>> centres_;  // of the views
  std::vector<Place> places_;                   // axes of the world, from the view's camera
  std::vector<Piece> pieces_;
};

}  // namespace maq
