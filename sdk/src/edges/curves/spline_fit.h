// Cubic B-splines through points in space, in their order.
#pragma once

#include <optional>
#include <vector>

#include "edges/curves/line_fit.h"

namespace maq {

inline constexpr int kMaxSplineControls = 16;

// The point of a clamped cubic B-spline with even knots at 0 <= t <= 1; `count` >= 4 control points.
Vec3 spline_point(const Vec3* controls, int count, double t);

class SplineFitter {
 public:
  // By least squares with as few control points as come within `tolerance` (units), or kMaxSplineControls; each point's
  // parameter moves to its foot. A closed one ends where it starts. Returns the root mean square of distances in units;
  // nothing where there are fewer than four points, where all are one place, or where they are not finite. The reverse
  // order gives the same curve.
  std::optional<double> fit(const FitPoint* points, size_t count, bool is_closed, double tolerance);

  const std::vector<Vec3>& controls() const { return controls_; }

 private:
  bool solve(const FitPoint* points, size_t count, int control_count, bool is_closed);

  std::vector<double> parameters_, off_;  // off_: of the robust weight
  std::vector<Vec3> controls_;
};

}  // namespace maq
