// The sizes of a fitted body with 90 % intervals.
#pragma once

#include <array>

#include "body/sizes/body_sizes.h"

namespace maq::body {

// Covariance of the shape coefficients after a fit, row by row at a stride of kMaxShapes.
using ShapeCovariance = std::array<double, kMaxShapes * kMaxShapes>;

struct SizeEstimate {
  double value_m = 0, low_m = 0, high_m = 0;
};

// `height_m`: the true height of the person, to which the body was fitted; 0: unknown. With it, the height is exact.
std::array<SizeEstimate, kSizes> estimate_sizes(const BodySizes& sizes, size_t shape_count, const ShapeNumbers& shape,
                                                const ShapeCovariance& covariance, double height_m);

}  // namespace maq::body
