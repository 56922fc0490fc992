// Where the anchors of a prior lie on a head that was fitted, and how sure that is.
#pragma once

#include <vector>

#include "head/head_prior.h"
#include "head/stored_head.h"

namespace maq::head {

// How much the size of heads differs, as a fraction of it: what the codes, whitened, do to the anchors' mean distance
// from their middle.
double size_sigma(const HeadPrior& prior);

// Of shape codes with that covariance, [codes][codes]. The sigmas are of what the codes do not say of a point, and of
// what the photos leave of the codes, but for the size, which no photo tells: that is size_sigma().
StoredAnchors known_anchors(const HeadPrior& prior, const std::vector<float>& shape,
                            const std::vector<float>& covariance);

}  // namespace maq::head
