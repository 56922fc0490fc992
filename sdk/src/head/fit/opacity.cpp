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
  sections_ = sections;
  is_clear_ = true;
  for (size_t i = 0; i <= sections && is_clear_; ++i) is_clear_ = sharpness * double(distances[i]) > -kMinLog;
  if (is_clear_) return;

  distances_.resize(sections + 1);
  inside_.resize(sections + 1);
  log_clear_.resize(sections);
  double depth_before = 0, rest_before = 0;
  for (size_t i = 0; i <= sections; ++i) {
    const double f = double(distances[i]), x = sharpness * f, e = std::exp(-std::abs(x));
    distances_[i] = f;
    inside_[i] = (x > 0 ? e : 1) / (1 + e);
    // softplus(-x) = s max(-f, 0) + log(1 + e^-|x|): apart, so that neither part eats the other's digits.
    const double depth = std::max(-f, 0.0), rest = std::log1p(e);
    if (i > 0) {
      const double log_clear = sharpness * (depth_before - depth) + (rest_before - rest);
      log_clear_[i - 1] = std::isfinite(f) && std::isfinite(distances_[i - 1]) && log_clear < 0 ? log_clear : 0;
      log_transmittance_ += log_clear_[i - 1];
    }
    depth_before = depth, rest_before = rest;
  }
}

void RayOpacity::back(double by_log_transmittance, float* by_distances) const {
  std::fill(by_distances, by_distances + sections_ + 1, 0.0F);
  if (is_clear_) return;
  double by_end = 0;  // of the far end of the section, by the section behind it
  for (size_t i = sections_; i-- > 0;) {
    double by_start = 0;
    if (log_clear_[i] < 0) {
      by_end += by_log_transmittance * sharpness_ * inside_[i + 1];
      by_start = -by_log_transmittance * sharpness_ * inside_[i];
    }
    by_distances[i + 1] = float(by_end);
    by_end = by_start;
  }
  by_distances[0] = float(by_end);
}

}  // namespace maq::head
