// The sizes of a fitted body with 90 % intervals.
#pragma once

#include <array>

#include "body/sizes/body_sizes.h"

namespace maq::body {

// Covariance of the shape coefficients after a fit, row by row at a stride of kMaxShapes.
using ShapeCovariance = std::array<double, kMaxShapes * kMaxShapes>;

// The shape that sizes are taken from. It is nearer to the average than the shape of the mesh, because the labels of an
// image share their errors: clothes and the network make a whole person wider.
struct SizeShape {
  ShapeNumbers mean{};
  ShapeCovariance covariance{};
};

// The shape of the best pose of an image.
struct FittedShape {
  ShapeNumbers shape{};
  ShapeNumbers prior_mean{};     // to which the fit drew it
  double prior_precision = 1;    // with this precision
  double image_weight = 1;       // by which the fit multiplied the precision of the image
  ShapeCovariance covariance{};  // with a prior of precision 1, whatever prior_precision is
};

// False where the covariance is singular.
bool find_shape_for_sizes(size_t shape_count, const FittedShape& fitted, SizeShape& shape);

struct SizeEstimate {
  double value_m = 0, low_m = 0, high_m = 0;
};

// `height_m`: the true height of the person, to which the body was fitted; 0: unknown. With it, the height is exact.
std::array<SizeEstimate, kSizes> estimate_sizes(const BodySizes& sizes, size_t shape_count, const SizeShape& shape,
                                                double height_m);

}  // namespace maq::body
