// The prior that an earlier fitted head gives for photos that are added later; it replaces the prior of the bundle.
#pragma once

#include <cstddef>
#include <vector>

#include "head/head_prior.h"
#include "head/stored_head.h"

namespace maq::head {

// Lower triangle L of L L^T = `covariance` [codes][codes], row by row; empty where it is not positive.
std::vector<float> covariance_factor(const std::vector<float>& covariance, size_t codes);

// Describes the heads of `prior` by codes u with a normal prior, given the earlier head's photos. Shape codes are z + L
// u, with the head's z and the remaining covariance after its photos. Colour codes are z + u, because a photo in other
// light may change them. So a fit with `prior` counts each earlier photo's cells, but not its pixels again.
class EarlierHead {
 public:
  // `prior_sha256`: of the prior's file. Throws MAQ_ERROR_UNSUPPORTED for a head that was fitted with another prior or
  // that has no covariance of its codes; MAQ_ERROR_INVALID_ARGUMENT for codes that no head has, and where it has so
  // many cameras that kMaxFitPhotos more are too many.
  EarlierHead(const HeadPrior& prior, const std::array<uint8_t, 32>& prior_sha256, StoredHead head);

  const HeadPrior& prior() const { return prior_; }
  const StoredHead& head() const { return head_; }

  // Converts codes of prior() to codes of the bundle's prior.
  FieldCodes codes(const FieldCodes& moved) const;
  std::vector<float> covariance(const std::vector<float>& moved) const;
  // The scale of a head with these anchors; a head of known size keeps its size.
  HeadScale scale(const HeadScale& by_prior, const StoredAnchors& anchors) const;

 private:
  StoredHead head_;
  HeadPrior prior_;
};

}  // namespace maq::head
