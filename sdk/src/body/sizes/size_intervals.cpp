#include "body/sizes/size_intervals.h"

#include <algorithm>
#include <cmath>

namespace maq::body {
namespace {

constexpr double kStep = 0.05;       // of a shape coefficient, for slopes
constexpr double kQuantile = 1.645;  // 90 % of a Gaussian lie within so many standard deviations

// Variance of the logarithm of a size: spread^2 times the variance that follows from the fit, plus floor^2.
struct SizeError {
  double spread, floor;
};

constexpr std::array<SizeError, kSizes> kErrors = {{{1, 0}, {1, 0}, {1, 0}, {1, 0}, {1, 0}}};

}  // namespace

std::array<SizeEstimate, kSizes> estimate_sizes(const BodySizes& sizes, size_t shape_count, const ShapeNumbers& shape,
                                                const ShapeCovariance& covariance, double height_m) {
  const Sizes found = sizes.sizes_m(shape);
  constexpr auto kHeight = size_t(Size::kHeight);
  std::array<SizeEstimate, kSizes> made;
  // A bundle may have a shape without a height, or no torso at a level.
  if (!std::all_of(found.begin(), found.end(), [](double size) { return size > 0; })) return made;
  const double scale = height_m > 0 ? height_m / found[kHeight] : 1;
  std::array<Sizes, kMaxShapes> slopes{};  // of the logarithms
  for (size_t s = 0; s < shape_count; ++s) {
    ShapeNumbers more = shape;
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
      for (size_t b = 0; b < shape_count; ++b) variance += slopes[a][k] * covariance[a * kMaxShapes + b] * slopes[b][k];
    }
    const SizeError& error = kErrors[k];
    const bool is_given = k == kHeight && height_m > 0;
    const double deviation =
        is_given ? 0 : std::sqrt(error.spread * error.spread * variance + error.floor * error.floor);
    const double value = scale * found[k], factor = std::exp(kQuantile * deviation);
    made[k] = {value, value / factor, value * factor};
  }
  return made;
}

}  // namespace maq::body
