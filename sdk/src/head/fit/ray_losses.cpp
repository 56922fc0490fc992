#include "head/fit/ray_losses.h"

#include <algorithm>
#include <cmath>

namespace maq::head {
namespace {

struct Robust {
  double loss, slope;  // slope: of the loss by e
};

Robust robust(double e, double limit) {
  const double part = 1 / (1 + e / limit);
  return {0.5 * e * part, 0.5 * part * part};
}

}  // namespace

ThreeLoss colour_loss(const float* logits, const float* rgb, double sigma, double limit) {
  double off[3], slopes[3], e = 0;
  for (int c = 0; c < 3; ++c) {
    const double colour = 1 / (1 + std::exp(-double(logits[c])));
    off[c] = (colour - double(rgb[c])) / sigma;
    slopes[c] = colour * (1 - colour) / sigma;
    e += off[c] * off[c];
  }
  const Robust at = robust(e, limit);
  ThreeLoss result;
  result.loss = at.loss;
  for (int c = 0; c < 3; ++c) result.by[c] = at.slope * 2 * off[c] * slopes[c];
  return result;
}

ThreeLoss template_loss(const float* point, const float* observed, double sigma_dm, double limit) {
  double off[3], e = 0;
  for (int c = 0; c < 3; ++c) {
    off[c] = (double(point[c]) - double(observed[c])) / sigma_dm;
    e += off[c] * off[c];
  }
  const Robust at = robust(e, limit);
  ThreeLoss result;
  result.loss = at.loss;
  for (int c = 0; c < 3; ++c) result.by[c] = at.slope * 2 * off[c] / sigma_dm;
  return result;
}

OpacityLoss matte_loss(double log_transmittance, double matte, double error_rate) {
  if (std::isnan(matte) || std::isnan(log_transmittance)) return {};
  const double clear = std::min(log_transmittance, 0.0), m = std::clamp(matte, 0.0, 1.0);
  const double right = 1 - 2 * error_rate, transmittance = std::exp(clear);
  const double in = error_rate - right * std::expm1(clear), out = error_rate + right * transmittance;
  return {-m * std::log(in) - (1 - m) * std::log(out), right * transmittance * (m / in - (1 - m) / out)};
}

}  // namespace maq::head
