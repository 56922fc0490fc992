#include "head/fit/opacity.h"

#include <algorithm>
#include <cmath>

namespace maq::head {

namespace {

constexpr double kMinLog = -100;

}  // namespace

void RayOpacity::run(const float* distances, size_t sections, double sharpness) {
  sharpness_ = sharpness;
  log_transmittance_ = 0;
  weights_.assign(sections, 0);
  is_clear_ = true;
  for (size_t i = 0; i <= sections && is_clear_; ++i) is_clear_ = sharpness * double(distances[i]) > -kMinLog;
  if (is_clear_) return;

  distances_.resize(sections + 1);
  inside_.resize(sections + 1);
  log_clear_.resize(sections);
  after_.resize(sections);
  double depth_before = 0, rest_before = 0, transmittance = 1;
  for (size_t i = 0; i <= sections; ++i) {
    const double f = double(distances[i]), x = sharpness * f, e = std::exp(-std::abs(x));
    distances_[i] = f;
    inside_[i] = (x > 0 ? e : 1) / (1 + e);
    // softplus(-x) = s max(-f, 0) + log(1 + e^-|x|): apart, so that neither part eats the other's digits.
    const double depth = std::max(-f, 0.0), rest = std::log1p(e);
    if (i > 0) {
      const double log_clear = sharpness * (depth_before - depth) + (rest_before - rest);
      log_clear_[i - 1] = std::isfinite(f) && std::isfinite(distances_[i - 1]) && log_clear < 0 ? log_clear : 0;
      weights_[i - 1] = float(-transmittance * std::expm1(log_clear_[i - 1]));
      log_transmittance_ += log_clear_[i - 1];
      after_[i - 1] = transmittance = std::exp(log_transmittance_);
    }
    depth_before = depth, rest_before = rest;
  }
}

double RayOpacity::opacity() const { return -std::expm1(log_transmittance_); }

void RayOpacity::back(const float* by_weights, double by_log_transmittance, float* by_distances,
                      double& by_sharpness) const {
  const size_t sections = weights_.size();
  std::fill(by_distances, by_distances + sections + 1, 0.0F);
  if (is_clear_) return;
  double behind = by_log_transmittance;  // sum of all sections behind, for log(1 - alpha)
  double by_end = 0;                     // of the far end of the section, by the section behind it
  for (size_t i = sections; i-- > 0;) {
    const double by_weight = double(by_weights[i]);
    const double before = i > 0 ? after_[i - 1] : 1;
    double by_start = 0;
    if (log_clear_[i] < 0) {
      const double by_log_clear = behind - by_weight * after_[i];
      by_end += by_log_clear * sharpness_ * inside_[i + 1];
      by_start = -by_log_clear * sharpness_ * inside_[i];
      by_sharpness += by_log_clear * (distances_[i + 1] * inside_[i + 1] - distances_[i] * inside_[i]);
    }
    by_distances[i + 1] = float(by_end);
    by_end = by_start;
    behind += by_weight * -before * std::expm1(log_clear_[i]);
  }
  by_distances[0] = float(by_end);
}

std::array<float, 3> blend_colours(const std::vector<float>& weights, const float* colours) {
  double sum[3] = {};
  for (size_t i = 0; i < weights.size(); ++i) {
    for (size_t c = 0; c < 3; ++c) sum[c] += double(weights[i]) * double(colours[3 * i + c]);
  }
  return {float(sum[0]), float(sum[1]), float(sum[2])};
}

void blend_colours_back(const std::vector<float>& weights, const float* colours, const std::array<float, 3>& by_colour,
                        float* by_colours, float* by_weights) {
  for (size_t i = 0; i < weights.size(); ++i) {
    for (size_t c = 0; c < 3; ++c) {
      by_colours[3 * i + c] = weights[i] * by_colour[c];
      by_weights[i] += colours[3 * i + c] * by_colour[c];
    }
  }
}

MatteTerm matte_cross_entropy(double log_transmittance, double matte) {
  MatteTerm term;
  if (std::isnan(matte) || std::isnan(log_transmittance)) {
    term.is_clamped = true;
    return term;
  }
  const double m = std::clamp(matte, 0.0, 1.0), clear = std::min(log_transmittance, 0.0);
  const double opacity = -std::expm1(clear);
  const double log_opacity = clear > -0.7 ? std::log(opacity) : std::log1p(-std::exp(clear));
  if (m > 0) {
    term.loss -= m * std::max(log_opacity, kMinLog);
    if (log_opacity > kMinLog) {
      term.by_log_transmittance += m * std::exp(clear) / opacity;
    } else {
      term.is_clamped = true;
    }
  }
  if (m < 1) {
    term.loss -= (1 - m) * std::max(clear, kMinLog);
    if (clear > kMinLog) {
      term.by_log_transmittance -= 1 - m;
    } else {
      term.is_clamped = true;
    }
  }
  return term;
}

}  // namespace maq::head
