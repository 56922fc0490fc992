// Straight lines through points in space.
#pragma once

#include <cstddef>
#include <optional>

#include "core/math/vec3.h"

namespace maq {

// A point with the length in which its distance from a curve is measured: 1 r at its place.
struct FitPoint {
  Vec3 point;
  double unit_m = 1;
  double weight = 1;
};

struct LineFit {
  Vec3 from, to;   // the feet of the outermost points, onward from the first point to the last
  double rms = 0;  // units
};

// By least squares with a robust weight. Nothing where the points are one place, or not finite. Their order matters to
// the line's direction alone.
std::optional<LineFit> fit_line(const FitPoint* points, size_t count);

// Nothing tells points within this fraction of their size from one place or one line: the rounding of float depth.
inline constexpr double kFitRounding = 1e-7;

}  // namespace maq
