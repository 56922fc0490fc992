#include "edges/measuring/boxes.h"

#include <algorithm>
#include <cmath>

namespace maq {
namespace {

constexpr double kEndSigma_r = 0.15;         // uncertainty of a corner along an edge with a perfect fit
constexpr double kOneLengthFraction = 0.06;  // parallel edges of one box have the same length within this fraction

bool is_line(const EdgeCurve& curve) { return curve.type == CurveType::kLine; }

Vec3 direction_of(const EdgeCurves& curves, const EdgeCurve& curve) {
  const Vec3* ends = &curves.points[size_t(curve.first_point)];
  return normalized(ends[1] - ends[0]);
}

// Returns the axis that is parallel to a direction within the tolerance (a sine), or -1.
int axis_of(const std::array<Vec3, 3>& axes, Vec3 direction, double tolerance) {
  for (int k = 0; k < 3; ++k) {
    if (length(cross(axes[size_t(k)], direction)) <= tolerance) return k;
  }
  return -1;
}

}  // namespace

// Two lines at a right angle. One must be a convex crease: the corner of a room has none. The third axis is
// perpendicular to both.
bool BoxFinder::begin(const EdgeCurves& curves, int corner, double tolerance, std::array<Vec3, 3>& axes) {
  for (size_t i = 0; i < curves.curves.size(); ++i) {
    const EdgeCurve& a = curves.curves[i];
    if (is_taken_[i] || !is_line(a) || a.convexity != Convexity::kConvex ||
        (a.corner[0] != corner && a.corner[1] != corner))
      continue;
    for (size_t j = 0; j < curves.curves.size(); ++j) {
      const EdgeCurve& b = curves.curves[j];
      if (j == i || is_taken_[j] || !is_line(b) || (b.corner[0] != corner && b.corner[1] != corner)) continue;
      const Vec3 u = direction_of(curves, a), v = direction_of(curves, b);
      if (std::abs(dot(u, v)) > tolerance) continue;
      axes[0] = u;
      axes[2] = normalized(cross(u, v));
      axes[1] = cross(axes[2], axes[0]);
      return true;
    }
  }
  return false;
}

void BoxFinder::collect(const EdgeCurves& curves, int corner, double tolerance, const std::array<Vec3, 3>& axes) {
  sides_.clear();
  is_visited_.assign(curves.corners.size(), 0);
  to_visit_.assign(1, corner);
  is_visited_[size_t(corner)] = 1;
  while (!to_visit_.empty()) {
    const int at = to_visit_.back();
    to_visit_.pop_back();
    for (size_t i = 0; i < curves.curves.size(); ++i) {
      const EdgeCurve& curve = curves.curves[i];
      if (is_taken_[i] || !is_line(curve) || (curve.corner[0] != at && curve.corner[1] != at)) continue;
      const int axis = axis_of(axes, direction_of(curves, curve), tolerance);
      const bool is_known = std::any_of(sides_.begin(), sides_.end(), [&](const Side& s) { return s.curve == int(i); });
      if (axis < 0 || is_known) continue;
      sides_.push_back({int(i), axis});
      for (const int next : curve.corner) {
        if (next < 0 || is_visited_[size_t(next)]) continue;
        is_visited_[size_t(next)] = 1;
        to_visit_.push_back(next);
      }
    }
  }
}

bool BoxFinder::measure(const EdgeField& field, const EdgeCurves& curves, MeasuredBox& box) const {
  std::array<double, 3> size{}, spread{};
  for (int axis = 0; axis < 3; ++axis) {
    // The mean of the lines between two corners, weighted by the certainty of their ends, around the best line.
    const auto each = [&](auto&& visit) {
      for (const Side& side : sides_) {
        const EdgeCurve& curve = curves.curves[size_t(side.curve)];
        if (side.axis != axis || curve.corner[0] < 0 || curve.corner[1] < 0) continue;
        const Vec3* ends = &curves.points[size_t(curve.first_point)];
        const double r = std::max(ends[0].z, ends[1].z) / focal_px(field.intrinsics);
        visit(curve.length_m, std::sqrt(2.0) * r * (kEndSigma_r + curve.rms_footprints));
      }
    };
    double best = 0, least = INFINITY, sum = 0, weights = 0, squares = 0;
    each([&](double length_m, double sigma_m) {
      if (sigma_m < least) least = sigma_m, best = length_m;
    });
    each([&](double length_m, double sigma_m) {
      if (std::abs(length_m - best) > kOneLengthFraction * best) return;
      sum += length_m / (sigma_m * sigma_m), weights += 1 / (sigma_m * sigma_m);
    });
    if (!(weights > 0)) return false;
    size[size_t(axis)] = sum / weights;
    double count = 0;
    each([&](double length_m, double) {
      if (std::abs(length_m - best) > kOneLengthFraction * best) return;
      squares += (length_m - sum / weights) * (length_m - sum / weights), count += 1;
    });
    // The larger of the uncertainty of the fits and the spread of the lines.
    spread[size_t(axis)] = 2 * std::max(1 / std::sqrt(weights), std::sqrt(squares / count));
  }
  std::array<int, 3> order{0, 1, 2};
  std::sort(order.begin(), order.end(), [&](int a, int b) { return size[size_t(a)] > size[size_t(b)]; });
  const std::array<Vec3, 3> axes = box.axis;
  Vec3 low{INFINITY, INFINITY, INFINITY}, high{-INFINITY, -INFINITY, -INFINITY};
  box.corners = 0;
  for (size_t i = 0; i < curves.corners.size(); ++i) {
    if (!is_visited_[i]) continue;
    const Vec3 p = curves.corners[i].point;
    const Vec3 at{dot(p, axes[0]), dot(p, axes[1]), dot(p, axes[2])};
    low = {std::min(low.x, at.x), std::min(low.y, at.y), std::min(low.z, at.z)};
    high = {std::max(high.x, at.x), std::max(high.y, at.y), std::max(high.z, at.z)};
    ++box.corners;
  }
  box.centre = (low.x + high.x) / 2 * axes[0] + (low.y + high.y) / 2 * axes[1] + (low.z + high.z) / 2 * axes[2];
  for (size_t k = 0; k < 3; ++k) {
    box.axis[k] = axes[size_t(order[k])];
    box.size_m[k] = size[size_t(order[k])];
    box.size_tolerance_m[k] = spread[size_t(order[k])];
  }
  return box.corners >= 4;
}

void BoxFinder::find(const EdgeField& field, const EdgeCurves& curves, std::vector<MeasuredBox>& found,
                     double focal_tolerance, double tolerance_deg) {
  found.clear();
  const double tolerance = std::sin(std::clamp(tolerance_deg, 0.0, 45.0) * M_PI / 180);
  is_taken_.assign(curves.curves.size(), 0);
  // Corners with many curves are the most reliable.
  for (const int least : {3, 2}) {
    for (size_t corner = 0; corner < curves.corners.size(); ++corner) {
      if (curves.corners[corner].curve_count < least) continue;
      MeasuredBox box;
      if (!begin(curves, int(corner), tolerance, box.axis)) continue;
      collect(curves, int(corner), tolerance, box.axis);
      if (!measure(field, curves, box)) continue;
      for (size_t k = 0; k < 3; ++k) {
        const double across = 1 - box.axis[k].z * box.axis[k].z;  // of the squared length
        box.size_tolerance_m[k] = std::hypot(box.size_tolerance_m[k], box.size_m[k] * across * focal_tolerance);
      }
      for (const Side& side : sides_) is_taken_[size_t(side.curve)] = 1;
      found.push_back(box);
    }
  }
  std::sort(found.begin(), found.end(), [](const MeasuredBox& a, const MeasuredBox& b) {
    return a.size_m[0] * a.size_m[1] * a.size_m[2] > b.size_m[0] * b.size_m[1] * b.size_m[2];
  });
}

}  // namespace maq
