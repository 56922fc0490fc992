// Corners: points where the ends of curves meet in space.
#pragma once

#include <vector>

#include "edges/curves/edge_curves.h"

namespace maq {

// An end of a curve that is not closed.
struct CurveEnd {
  int curve;
  int which;  // 0: start, 1: end
  Vec3 point;
  Vec3 outward;   // direction of the curve where it ends, away from it, length 1
  double r_m;     // a footprint there
  double step_m;  // a pixel along the curve there
  int corner = -1;
};

class CornerFinder {
 public:
  // Groups ends whose curves, made longer, meet within `merge_radius_px` pixels of them; sets CurveEnd::corner. A
  // corner is the point nearest to all its curves, or the middle of the ends as far as the curves run the same way and
  // do not tell.
  void find(std::vector<CurveEnd>& ends, double merge_radius_px, std::vector<EdgeCorner>& corners);

 private:
  std::vector<int> group_;
};

}  // namespace maq
