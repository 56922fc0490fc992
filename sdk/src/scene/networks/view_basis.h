// The functions of the viewing direction that descriptors are linear in (NPBG++, arXiv 2203.13318, section 3.3): a
// small network that all points of all scenes share.
#pragma once

#include <cstddef>
#include <vector>

#include "scene/descriptor.h"

namespace maq {

// Weights in torch's order, [out][in]: 18-16-16-6, leaky ReLU (0.01) in between. The inputs are the sines of x, y, z
// and the cosines of x, y, z, for pi/2, pi and 2 pi times the direction.
class ViewBasis {
 public:
  static constexpr int kEncoded = 18, kHidden = 16;
  static constexpr size_t kWeights =
      kHidden * kEncoded + kHidden + kHidden * kHidden + kHidden + kBasis * kHidden + kBasis;

  // `weights`: weight and bias of each layer, one after the other; kWeights values.
  explicit ViewBasis(const std::vector<float>& weights) : weights_(weights) {}

  // Evaluates `count` unit vectors, one array for each coordinate; values [kBasis][count].
  void evaluate(const float* x, const float* y, const float* z, size_t count, float* values) const;

 private:
  std::vector<float> weights_;
};

}  // namespace maq
