#include "head/texture/photo_light.h"

#include <algorithm>
#include <cstddef>

#include "core/math/small_solve.h"

namespace maq::head {
namespace {

// gain, offset, directed light
constexpr int kUnknowns = 5;
// Where own colours, or their products with normals, vary by less (grey levels, squared), the fit is nearer to the
// plain gain. Found on validation heads: new views are best at 100 to 400, and 300 to 1000.
constexpr double kGainVariance = 200, kDirectedVariance = 700;
// Fixes the scale of an offset, no more: the weight of 100 grey levels of it.
constexpr double kOffsetVariance = 1e-3, kOffsetUnit = 100;
constexpr double kMaxPlainGain = 2;

using Terms = std::array<double, kUnknowns>;

Terms terms_of(float own, const float* normal) {
  const double value = double(own);
  return {value, kOffsetUnit, value * double(normal[0]), value * double(normal[1]), value * double(normal[2])};
}

}  // namespace

double ChannelLight::strength(const float* normal) const {
  return gain + directed.x * double(normal[0]) + directed.y * double(normal[1]) + directed.z * double(normal[2]);
}

float ChannelLight::operator()(float own, const float* normal) const {
  return float(std::clamp(strength(normal) * double(own) + offset, 0.0, 255.0));
}

float ChannelLight::evened(float seen, const float* normal, double even, double darkest) const {
  if (!(even > 0)) return seen;
  const double factor = even / std::max(strength(normal), darkest * even);
  return float(std::clamp((double(seen) - offset) * factor + offset, 0.0, 255.0));
}

PhotoLight fit_photo_light(const std::vector<float>& weights, const std::vector<float>& own,
                           const std::vector<float>& differences, const std::vector<float>& normals) {
  double total = 0;
  for (const float weight : weights) total += double(weight);
  PhotoLight fitted;
  if (!(total > 0)) return fitted;
  for (size_t channel = 0; channel < 3; ++channel) {
    double matrix[kUnknowns * kUnknowns] = {}, right[kUnknowns] = {};
    for (size_t i = 0; i < weights.size(); ++i) {
      const double weight = double(weights[i]) / total;
      if (weight <= 0) continue;
      const Terms terms = terms_of(own[3 * i + channel], &normals[3 * i]);
      const double seen = terms[0] + double(differences[3 * i + channel]);
      for (size_t row = 0; row < kUnknowns; ++row) {
        for (size_t column = 0; column <= row; ++column)
          matrix[row * kUnknowns + column] += weight * terms[row] * terms[column];
        right[row] += weight * terms[row] * seen;
      }
    }
    const double mean_own = matrix[kUnknowns] / kOffsetUnit, mean_seen = right[1] / kOffsetUnit;
    const double plain_gain = std::min(kMaxPlainGain, mean_seen / std::max(mean_own, 1.0));
    const Terms ridge = {kGainVariance, kOffsetVariance, kDirectedVariance, kDirectedVariance, kDirectedVariance};
    for (size_t i = 0; i < kUnknowns; ++i) matrix[i * (kUnknowns + 1)] += ridge[i];
    right[0] += kGainVariance * plain_gain;
    if (!solve_positive(matrix, kUnknowns, kUnknowns, right, 1)) continue;
    fitted[channel] = {right[0], kOffsetUnit * right[1], {right[2], right[3], right[4]}};
  }
  return fitted;
}

}  // namespace maq::head
