// The corner, edge or plane at a pixel: what a pointer snaps to.
#pragma once

#include "edges/curves/edge_curves.h"

namespace maq {

enum class SnapTarget : uint8_t { kNothing, kCorner, kEdge, kPlane };

struct Snap {
  SnapTarget target = SnapTarget::kNothing;
  int index = -1;          // of EdgeCurves::corners or ::curves; of a plane, a curve that it is beside
  int side = 0;            // of a plane: of that curve
  Vec3 point;              // of the target, the nearest to the pixel's ray
  double distance_px = 0;  // in the picture; 0 on a plane
};

// A corner within `radius_px` of the pixel, or else the nearest edge within it, or else the plane beside an edge that
// the pixel's depth lies on, within 2 r. The pixel may be any place, (0, 0) the centre of the first; what is not finite
// has nothing.
Snap snap_to(const EdgeField& field, const EdgeCurves& curves, double x_px, double y_px, double radius_px = 8);

}  // namespace maq
