#include "head/fit/code_prior.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"

namespace maq::head {
namespace {

// The encoder is a little too sure of heads that it was not trained on.
constexpr double kSigmaFactor = 1.2;
constexpr double kMinLogCodeSigma = -3, kMaxLogCodeSigma = 1, kMaxMean = 10;

}  // namespace

double CodePrior::cost(const double* codes) const {
  double sum = 0;
  for (size_t k = 0; k < means.size(); ++k) sum += std::pow(codes[k] - means[k], 2) * inverse_variances[k];
  return sum;
}

CodePrior code_prior(const std::vector<const HeadPhoto*>& photos, size_t codes) {
  CodePrior prior{std::vector<double>(codes), std::vector<double>(codes, 1.0)};
  for (const HeadPhoto* photo : photos) {
    if (photo->codes.empty()) continue;
    if (photo->codes.size() != 2 * codes) {
      throw Error(MAQ_ERROR_INVALID_ARGUMENT, "A photo says ", photo->codes.size() / 2,
                  " shape codes of a head, whose ", "prior has ", codes, ".");
    }
    for (size_t k = 0; k < codes; ++k) {
      const double mean = double(photo->codes[2 * k]), log_sigma = double(photo->codes[2 * k + 1]);
      if (!std::isfinite(mean) || !std::isfinite(log_sigma)) continue;
      const double sigma = kSigmaFactor * std::exp(std::clamp(log_sigma, kMinLogCodeSigma, kMaxLogCodeSigma));
      const double inverse = 1 / (sigma * sigma);
      if (!(inverse > 1)) continue;
      // means holds the sum of mean / variance until all photos are in.
      prior.means[k] += inverse * std::clamp(mean, -kMaxMean, kMaxMean);
      prior.inverse_variances[k] += inverse - 1;
    }
  }
  for (size_t k = 0; k < codes; ++k) prior.means[k] /= prior.inverse_variances[k];
  return prior;
}

}  // namespace maq::head
