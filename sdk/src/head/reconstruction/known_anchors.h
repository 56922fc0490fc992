// Where the anchors of a prior lie on a head that was fitted, and how sure that is.
#pragma once

#include <vector>

#include "head/head_prior.h"
#include "head/stored_head.h"

namespace maq::head {

// Standard deviation of the size of heads, as a fraction of the size: the effect of the whitened codes on the anchors'
// mean distance from their middle.
double size_sigma(const HeadPrior& prior);

// Anchors of shape codes with this covariance, [codes][codes]. Sigmas include the part of a point that the codes do not
// explain, and the uncertainty of the codes after the photos. They exclude the size, which no photo tells
// (size_sigma()).
StoredAnchors known_anchors(const HeadPrior& prior, const std::vector<float>& shape,
                            const std::vector<float>& covariance);

}  // namespace maq::head
