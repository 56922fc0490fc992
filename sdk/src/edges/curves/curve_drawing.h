// The polyline of a line, an arc or a spline, and its length.
#pragma once

#include <array>

#include "edges/curves/edge_curves.h"

namespace maq {

// Appends the points of a curve to curves.points, and the curve with its length to curves.curves. `end`: the ends of a
// line. The control points of a spline are in curves.controls.
void append_curve(EdgeCurve curve, const std::array<Vec3, 2>& end, EdgeCurves& curves);

}  // namespace maq
