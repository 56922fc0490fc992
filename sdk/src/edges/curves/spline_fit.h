// Cubic B-splines through points in space, in their order.
#pragma once

#include <optional>
#include <vector>

#include "edges/curves/line_fit.h"

namespace maq {

inline constexpr int kMaxSplineControls = 16;

// Returns the point of a clamped cubic B-spline with even knots at 0 <= t <= 1; `count` >= 4 control points.
Vec3 spline_point(const Vec3* controls, int count, double t);

class SplineFitter {
 public:
  // Fits by least squares with the fewest control points that come within `tolerance` (units), at most
  // kMaxSplineControls. The parameter of each point moves to its foot. A closed curve ends where it starts. Returns the
  // root mean square distance in units; nothing for fewer than four points, or points that coincide or are not finite.
  // The reverse order gives the same curve.
  std::optional<double> fit(const FitPoint* points, size_t count, bool is_closed, double tolerance);

  const std::vector<Vec3>& controls() const { return controls_; }

 private:
  bool solve(const FitPoint* points, size_t count, int control_count, bool is_closed);

  std::vector<double> parameters_, off_;  // off_: distances for the robust weight
  std::vector<Vec3> controls_;
};

}  // namespace maq
