// Losses of a photo's ray against the field, with derivatives: negative log likelihoods. An error e in squared sigmas
// costs 1/2 e / (1 + e / limit) (Geman-McClure): a large error no longer pulls.
#pragma once

namespace maq::head {

struct ThreeLoss {
  double loss = 0;
  double by[3] = {};
};

// The colour of logits against red, green and blue in 0..1, each with this sigma. By the logits.
ThreeLoss colour_loss(const float* logits, const float* rgb, double sigma, double limit);

// Loss of two points of the template head with this sigma (dm) in each coordinate; derivative by the first point.
ThreeLoss template_loss(const float* point, const float* observed, double sigma_dm, double limit);

// Cross entropy of the opacity 1 - e^log_transmittance with a matte in 0..1, of which a fraction `error_rate` is wrong
// whatever it says: so a wrong one costs -log error_rate at most, and pulls at nothing far away. A matte that is not a
// number has no loss.
struct OpacityLoss {
  double loss = 0;
  double by_log_transmittance = 0;
};
OpacityLoss matte_loss(double log_transmittance, double matte, double error_rate);

}  // namespace maq::head
