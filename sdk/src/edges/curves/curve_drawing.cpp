#include "edges/curves/curve_drawing.h"

#include <algorithm>
#include <cmath>

#include "edges/curves/spline_fit.h"

namespace maq {
namespace {

constexpr double kArcStep_rad = 0.07;
constexpr int kStepsOfSpan = 8;  // of a spline

}  // namespace

void append_curve(EdgeCurve curve, const std::array<Vec3, 2>& end, EdgeCurves& curves) {
  curve.first_point = int(curves.points.size());
  if (curve.type == CurveType::kLine) {
    curves.points.push_back(end[0]);
    curves.points.push_back(end[1]);
  } else if (curve.type == CurveType::kArc) {
    const int steps = std::max(1, int(std::ceil(curve.sweep_rad / kArcStep_rad)));
    for (int i = 0; i <= steps; ++i) {
      const double a = curve.sweep_rad * i / steps;
      curves.points.push_back(curve.centre + std::cos(a) * curve.x_axis + std::sin(a) * curve.y_axis);
    }
  } else {
    const int steps = kStepsOfSpan * (curve.control_count - 3);
    for (int i = 0; i <= steps; ++i) {
      const double t = double(i) / steps;
      curves.points.push_back(spline_point(&curves.controls[size_t(curve.first_control)], curve.control_count, t));
    }
  }
  curve.point_count = int(curves.points.size()) - curve.first_point;
  for (size_t i = size_t(curve.first_point) + 1; i < curves.points.size(); ++i) {
    curve.length_m += length(curves.points[i] - curves.points[i - 1]);
  }
  if (curve.type == CurveType::kArc) curve.length_m = curve.sweep_rad * length(curve.x_axis);
  curves.curves.push_back(curve);
}

}  // namespace maq
