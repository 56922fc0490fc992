// Finds the corner, edge or plane at a pixel or on a ray, for a pointer that snaps.
#pragma once

#include "edges/curves/edge_curves.h"

namespace maq {

enum class SnapTarget : uint8_t { kNothing, kCorner, kEdge, kPlane };

struct Snap {
  SnapTarget target = SnapTarget::kNothing;
  int index = -1;  // in EdgeCurves::corners or ::curves; for a plane, an adjacent curve
  int side = 0;    // for a plane: its side of the curve
  Vec3 point;      // the point of the target that is nearest to the ray
  // Distance in the image, or angle seen from the ray's origin; 0 on a plane.
  double distance_px = 0, angle_rad = 0;
};

// Both functions need camera and depth_m of the field. depth_m may be empty: then there are no planes.

// Finds a corner within `radius_px` of the pixel, or else the nearest edge within it, or else the plane beside an edge
// on which the pixel's depth lies within 2 r. The position need not be a whole pixel; (0, 0) is the centre of the
// first. A position that is not finite has no target.
Snap snap_to(const EdgeField& field, const EdgeCurves& curves, double x_px, double y_px, double radius_px = 8);

// Finds the target along a ray in the curves' coordinates. A plane is the first one that the ray hits where the depth
// of the frame lies on it. The direction is not 0.
Snap snap_to_ray(const EdgeField& field, const EdgeCurves& curves, Vec3 origin, Vec3 direction, double max_angle_rad);

}  // namespace maq
