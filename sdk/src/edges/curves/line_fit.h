// Straight lines through points in space.
#pragma once

#include <cstddef>
#include <optional>

#include "core/math/vec3.h"

namespace maq {

// A point with its unit of distance from a curve: one footprint r.
struct FitPoint {
  Vec3 point;
  double unit_m = 1;
  double weight = 1;
};

struct LineFit {
  Vec3 from, to;   // the feet of the outermost points, in the direction from the first point to the last
  double rms = 0;  // units
};

// Fits by least squares with a robust weight. Returns nothing for points that coincide or are not finite. Their order
// affects only the direction of the line.
std::optional<LineFit> fit_line(const FitPoint* points, size_t count);

// Points within this fraction of their size count as one point or one line: the rounding of float depth.
inline constexpr double kFitRounding = 1e-7;

}  // namespace maq
