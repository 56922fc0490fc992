#include "edges/measuring/snap.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace maq {
namespace {

constexpr double kOnPlane_r = 2;

struct ImagePoint {
  double x, y;
};

// Projects curves to an image in which distances are measured: of the depth camera, or of a camera along a ray.
struct Viewer {
  Intrinsics camera;
  Vec3 origin;
  std::array<Vec3, 3> axis{Vec3{1, 0, 0}, Vec3{0, 1, 0}, Vec3{0, 0, 1}};

  Vec3 seen(Vec3 p) const {
    const Vec3 d = p - origin;
    return {dot(d, axis[0]), dot(d, axis[1]), dot(d, axis[2])};
  }
  ImagePoint projected(Vec3 p) const {
    return {camera.fx_px * p.x / p.z + camera.cx_px, camera.fy_px * p.y / p.z + camera.cy_px};
  }
};

// The distance of a segment of a polyline from (x, y) in the image, and the fraction of the segment in space.
double distance_to_piece(const Viewer& viewer, Vec3 a, Vec3 b, double x, double y, double& fraction) {
  const ImagePoint p = viewer.projected(a), q = viewer.projected(b);
  const double dx = q.x - p.x, dy = q.y - p.y, size = dx * dx + dy * dy;
  const double s = size > 0 ? std::clamp(((x - p.x) * dx + (y - p.y) * dy) / size, 0.0, 1.0) : 0.0;
  // This fraction in the image is a smaller fraction in space where the segment runs away from the viewer.
  fraction = s * a.z / (s * a.z + (1 - s) * b.z);
  return std::hypot(p.x + s * dx - x, p.y + s * dy - y);
}

// Finds the nearest corner within `radius` pixels of the viewer's image, or else the nearest edge.
Snap snap_to_curves(const Viewer& viewer, const EdgeCurves& curves, double x, double y, double radius) {
  Snap snap;
  double best = radius;
  for (size_t i = 0; i < curves.corners.size(); ++i) {
    const Vec3 p = viewer.seen(curves.corners[i].point);
    if (!(p.z > 0)) continue;
    const ImagePoint at = viewer.projected(p);
    const double distance = std::hypot(at.x - x, at.y - y);
    if (!(distance <= best)) continue;
    best = distance;
    snap = {SnapTarget::kCorner, int(i), 0, curves.corners[i].point, distance, 0};
  }
  if (snap.target != SnapTarget::kNothing) return snap;
  for (size_t i = 0; i < curves.curves.size(); ++i) {
    const EdgeCurve& curve = curves.curves[i];
    for (int k = 0; k + 1 < curve.point_count; ++k) {
      const Vec3* ends = &curves.points[size_t(curve.first_point + k)];
      const Vec3 a = viewer.seen(ends[0]), b = viewer.seen(ends[1]);
      if (!(a.z > 0 && b.z > 0)) continue;
      double t = 0;
      const double distance = distance_to_piece(viewer, a, b, x, y, t);
      if (!(distance <= best)) continue;
      best = distance;
      snap = {SnapTarget::kEdge, int(i), 0, ends[0] + t * (ends[1] - ends[0]), distance, 0};
    }
  }
  return snap;
}

// Returns the point that the frame saw in a direction; 0 along the ray: unknown.
double depth_at(const EdgeField& field, double x_px, double y_px) {
  if (!(x_px > -0.5 && y_px > -0.5 && x_px < field.width - 0.5 && y_px < field.height - 0.5)) return 0;
  if (field.depth_m.empty()) return 0;
  return double(field.depth_m[size_t(std::lround(y_px)) * size_t(field.width) + size_t(std::lround(x_px))]);
}

Vec3 ray_of(const Intrinsics& camera, double x_px, double y_px) {
  return {(x_px - camera.cx_px) / camera.fx_px, (y_px - camera.cy_px) / camera.fy_px, 1};
}

// Returns the distance of a point of the frame from a plane, in r. It is perpendicular to the plane, not along the ray:
// at a grazing angle the ray leaves the plane slowly.
double off_plane_r(const EdgeField& field, const Plane& plane, Vec3 point) {
  return std::abs(dot(plane.normal, point) - plane.offset_m) * focal_px(field.intrinsics) / point.z;
}

// Calls `visit` with each plane beside a curve, the curve's index and the side.
template <class Visit>
void for_planes(const EdgeCurves& curves, Visit&& visit) {
  for (size_t i = 0; i < curves.curves.size(); ++i) {
    for (size_t side = 0; side < 2; ++side) {
      if (curves.curves[i].has_plane[side]) visit(curves.curves[i].plane[side], int(i), int(side));
    }
  }
}

}  // namespace

Snap snap_to(const EdgeField& field, const EdgeCurves& curves, double x_px, double y_px, double radius_px) {
  if (!std::isfinite(x_px + y_px)) return {};
  Snap snap = snap_to_curves({field.intrinsics, {}}, curves, x_px, y_px, radius_px);
  const double depth = depth_at(field, x_px, y_px);
  if (snap.target != SnapTarget::kNothing || !(depth > 0)) return snap;
  const Vec3 ray = ray_of(field.intrinsics, x_px, y_px);
  double best_r = kOnPlane_r;
  for_planes(curves, [&](const Plane& plane, int curve, int side) {
    const double t = plane.offset_m / dot(plane.normal, ray), off_r = off_plane_r(field, plane, depth * ray);
    if (!(t > 0) || !std::isfinite(t) || !(off_r < best_r)) return;
    best_r = off_r;
    snap = {SnapTarget::kPlane, curve, side, t * ray, 0, 0};
  });
  return snap;
}

Snap snap_to_ray(const EdgeField& field, const EdgeCurves& curves, Vec3 origin, Vec3 direction, double max_angle_rad) {
  Viewer viewer;
  viewer.camera.fx_px = viewer.camera.fy_px = 1;
  viewer.origin = origin;
  viewer.axis[2] = normalized(direction);
  viewer.axis[0] = any_orthogonal(viewer.axis[2]);
  viewer.axis[1] = cross(viewer.axis[2], viewer.axis[0]);
  Snap snap = snap_to_curves(viewer, curves, 0, 0, std::tan(max_angle_rad));
  snap.angle_rad = std::atan(std::exchange(snap.distance_px, 0));
  if (snap.target != SnapTarget::kNothing) return snap;
  const Intrinsics& camera = field.intrinsics;
  double nearest = INFINITY;
  for_planes(curves, [&](const Plane& plane, int curve, int side) {
    const double t = (plane.offset_m - dot(plane.normal, origin)) / dot(plane.normal, viewer.axis[2]);
    if (!(t > 0) || !(t < nearest)) return;
    const Vec3 hit = origin + t * viewer.axis[2];
    if (!(hit.z > 0)) return;
    const double x_px = camera.fx_px * hit.x / hit.z + camera.cx_px, y_px = camera.fy_px * hit.y / hit.z + camera.cy_px;
    const double depth = depth_at(field, x_px, y_px);
    if (!(depth > 0) || !(off_plane_r(field, plane, depth * ray_of(camera, x_px, y_px)) < kOnPlane_r)) return;
    nearest = t;
    snap = {SnapTarget::kPlane, curve, side, hit, 0, 0};
  });
  return snap;
}

}  // namespace maq
