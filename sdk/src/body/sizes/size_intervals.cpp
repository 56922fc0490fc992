#include "body/sizes/size_intervals.h"

#include <algorithm>
#include <cmath>

#include "core/math/small_solve.h"

namespace maq::body {
namespace {

constexpr double kStep = 0.05;       // of a shape coefficient, for slopes
constexpr double kQuantile = 1.645;  // 90 % of a Gaussian lie within so many standard deviations

// How much the labels of an image agree in their errors: their variance counts so many times. With 4, girths of
// rendered people are nearest to the true ones.
constexpr double kSharedErrors = 4;

// Standard deviation of the logarithm of a size, by that which follows from the fit. Measured on rendered people with
// the shipped networks (export/evaluation/body_sizes.py), so that 90 % of true sizes are inside.
constexpr Sizes kSpread = {1.05, 1.15, 1.1, 1.12, 1.1};

}  // namespace

bool find_shape_for_sizes(size_t shape_count, const FittedShape& fitted, SizeShape& shape) {
  const auto size = int(shape_count), stride = int(kMaxShapes);
  // Precision of image and prior together, and its product with the fitted shape, in which the prior has no part.
  ShapeCovariance factor = fitted.covariance, precision{};
  for (size_t s = 0; s < shape_count; ++s) precision[s * shape_count + s] = 1;
  if (!solve_positive(factor.data(), size, stride, precision.data(), size)) return false;
  ShapeNumbers product{};
  for (size_t a = 0; a < shape_count; ++a) {
    for (size_t b = 0; b < shape_count; ++b) product[a] += precision[a * shape_count + b] * fitted.shape[b];
    product[a] += (fitted.prior_precision - 1) * fitted.shape[a] - fitted.prior_precision * fitted.prior_mean[a];
  }
  // The same image, without that weight, against a prior of kSharedErrors; all times the weight.
  const double prior = kSharedErrors * fitted.image_weight;
  ShapeCovariance whole{};
  for (size_t a = 0; a < shape_count; ++a) {
    for (size_t b = 0; b < shape_count; ++b) {
      whole[a * kMaxShapes + b] = precision[a * shape_count + b] + (a == b ? prior - 1 : 0);
    }
  }
  factor = whole;
  if (!solve_positive(factor.data(), size, stride, product.data(), 1)) return false;
  shape.mean = product;
  ShapeCovariance inverse{};
  for (size_t s = 0; s < shape_count; ++s) inverse[s * shape_count + s] = prior;
  if (!solve_positive(whole.data(), size, stride, inverse.data(), size)) return false;
  shape.covariance = {};
  for (size_t a = 0; a < shape_count; ++a) {
    for (size_t b = 0; b < shape_count; ++b) shape.covariance[a * kMaxShapes + b] = inverse[a * shape_count + b];
  }
  return true;
}

std::array<SizeEstimate, kSizes> estimate_sizes(const BodySizes& sizes, size_t shape_count, const SizeShape& shape,
                                                double height_m) {
  const Sizes found = sizes.sizes_m(shape.mean);
  constexpr auto kHeight = size_t(Size::kHeight);
  std::array<SizeEstimate, kSizes> made;
  // A bundle may have a shape without a height, or no torso at a level.
  if (!std::all_of(found.begin(), found.end(), [](double size) { return size > 0; })) return made;
  const double scale = height_m > 0 ? height_m / found[kHeight] : 1;
  std::array<Sizes, kMaxShapes> slopes{};  // of the logarithms
  for (size_t s = 0; s < shape_count; ++s) {
    ShapeNumbers more = shape.mean;
    more[s] += kStep;
    const Sizes changed = sizes.sizes_m(more);
    for (size_t k = 0; k < kSizes; ++k) {
      slopes[s][k] = changed[k] > 0 ? std::log(changed[k] / found[k]) / kStep : 0;
      if (height_m > 0) slopes[s][k] -= slopes[s][kHeight];
    }
  }
  for (size_t k = 0; k < kSizes; ++k) {
    double variance = 0;
    for (size_t a = 0; a < shape_count; ++a) {
      for (size_t b = 0; b < shape_count; ++b)
        variance += slopes[a][k] * shape.covariance[a * kMaxShapes + b] * slopes[b][k];
    }
    const bool is_given = k == kHeight && height_m > 0;
    const double deviation = is_given ? 0 : kSpread[k] * std::sqrt(std::max(variance, 0.0));
    const double value = scale * found[k], factor = std::exp(kQuantile * deviation);
    made[k] = {value, value / factor, value * factor};
  }
  return made;
}

}  // namespace maq::body
