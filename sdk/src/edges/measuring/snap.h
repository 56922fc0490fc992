// The corner, edge or plane at a pixel or on a ray: what a pointer snaps to.
#pragma once

#include "edges/curves/edge_curves.h"

namespace maq {

enum class SnapTarget : uint8_t { kNothing, kCorner, kEdge, kPlane };

struct Snap {
  SnapTarget target = SnapTarget::kNothing;
  int index = -1;  // of EdgeCurves::corners or ::curves; of a plane, a curve that it is beside
  int side = 0;    // of a plane: of that curve
  Vec3 point;      // of the target, the nearest to the ray
  // In the picture, or an angle as seen from the ray's origin; 0 on a plane.
  double distance_px = 0, angle_rad = 0;
};

// Of the field, both need camera and depth_m, which may be empty: then there are no planes.

// A corner within `radius_px` of the pixel, or else the nearest edge within it, or else the plane beside an edge that
// the pixel's depth lies on, within 2 r. The pixel may be any place, (0, 0) the centre of the first; what is not finite
// has nothing.
Snap snap_to(const EdgeField& field, const EdgeCurves& curves, double x_px, double y_px, double radius_px = 8);

// The same along a ray in the curves' coordinates; its plane is the first that it hits at a place where the frame's
// depth lies on it. The direction is not 0.
Snap snap_to_ray(const EdgeField& field, const EdgeCurves& curves, Vec3 origin, Vec3 direction, double max_angle_rad);

}  // namespace maq
