// What is known of a head's shape codes before its cells are looked at.
#pragma once

#include <cstddef>
#include <vector>

#include "head/fit/observations.h"

namespace maq::head {

// Codes are independent and normal.
struct CodePrior {
  std::vector<double> means, inverse_variances;

  // Twice the negative log likelihood of codes, up to a constant.
  double cost(const double* codes) const;
};

// N(0, 1), times what the encoder says of each of the photos (HeadPhoto::codes). Since that knows the N(0, 1) already,
// a photo adds 1/sigma^2 - 1 to the inverse variance of a code, and nothing where it is no surer than that. Throws
// MAQ_ERROR_INVALID_ARGUMENT for a photo with another number of codes, and ignores those that are not finite.
CodePrior code_prior(const std::vector<const HeadPhoto*>& photos, size_t codes);

}  // namespace maq::head
