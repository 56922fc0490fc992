#include "edges/measuring/snap.h"

#include <algorithm>
#include <cmath>

namespace maq {
namespace {

constexpr double kOnPlane_r = 2;

struct ImagePoint {
  double x, y;
};

ImagePoint projected(const Intrinsics& camera, Vec3 p) {
  return {camera.fx_px * p.x / p.z + camera.cx_px, camera.fy_px * p.y / p.z + camera.cy_px};
}

// The nearest place to (x, y) of a piece of a polyline as it is seen: how far it is, and its point.
double distance_to_piece(const Intrinsics& camera, Vec3 a, Vec3 b, double x, double y, Vec3& nearest) {
  const ImagePoint p = projected(camera, a), q = projected(camera, b);
  const double dx = q.x - p.x, dy = q.y - p.y, size = dx * dx + dy * dy;
  const double s = size > 0 ? std::clamp(((x - p.x) * dx + (y - p.y) * dy) / size, 0.0, 1.0) : 0.0;
  // This fraction of the way in the picture is less of the way in space where the piece runs away from the camera.
  const double t = s * a.z / (s * a.z + (1 - s) * b.z);
  nearest = a + t * (b - a);
  return std::hypot(p.x + s * dx - x, p.y + s * dy - y);
}

void snap_to_plane(const EdgeField& field, const EdgeCurves& curves, double x_px, double y_px, Snap& snap) {
  const Intrinsics& camera = field.intrinsics;
  if (!(x_px > -0.5 && y_px > -0.5 && x_px < field.width - 0.5 && y_px < field.height - 0.5)) return;
  const size_t at = size_t(std::lround(y_px)) * size_t(field.width) + size_t(std::lround(x_px));
  const double depth = field.depth_m[at];
  if (!(depth > 0)) return;
  const Vec3 ray{(x_px - camera.cx_px) / camera.fx_px, (y_px - camera.cy_px) / camera.fy_px, 1};
  double best = kOnPlane_r * depth / focal_px(camera);
  for (size_t i = 0; i < curves.curves.size(); ++i) {
    for (size_t side = 0; side < 2; ++side) {
      if (!curves.curves[i].has_plane[side]) continue;
      const Plane& plane = curves.curves[i].plane[side];
      const double t = plane.offset_m / dot(plane.normal, ray);
      // Off the plane, not along the ray: at a grazing angle the ray leaves it slowly.
      const double off = std::abs(dot(plane.normal, depth * ray) - plane.offset_m);
      if (!(t > 0) || !std::isfinite(t) || !(off < best)) continue;
      best = off;
      snap = {SnapTarget::kPlane, int(i), int(side), t * ray, 0};
    }
  }
}

}  // namespace

Snap snap_to(const EdgeField& field, const EdgeCurves& curves, double x_px, double y_px, double radius_px) {
  Snap snap;
  double best = radius_px;
  if (!std::isfinite(x_px + y_px)) return snap;
  for (size_t i = 0; i < curves.corners.size(); ++i) {
    const Vec3 p = curves.corners[i].point;
    if (!(p.z > 0)) continue;
    const ImagePoint seen = projected(field.intrinsics, p);
    const double distance = std::hypot(seen.x - x_px, seen.y - y_px);
    if (!(distance <= best)) continue;
    best = distance;
    snap = {SnapTarget::kCorner, int(i), 0, p, distance};
  }
  if (snap.target != SnapTarget::kNothing) return snap;
  for (size_t i = 0; i < curves.curves.size(); ++i) {
    const EdgeCurve& curve = curves.curves[i];
    for (int k = 0; k + 1 < curve.point_count; ++k) {
      const Vec3 a = curves.points[size_t(curve.first_point + k)], b = curves.points[size_t(curve.first_point + k) + 1];
      if (!(a.z > 0 && b.z > 0)) continue;
      Vec3 nearest;
      const double distance = distance_to_piece(field.intrinsics, a, b, x_px, y_px, nearest);
      if (!(distance <= best)) continue;
      best = distance;
      snap = {SnapTarget::kEdge, int(i), 0, nearest, distance};
    }
  }
  if (snap.target == SnapTarget::kNothing) snap_to_plane(field, curves, x_px, y_px, snap);
  return snap;
}

}  // namespace maq
