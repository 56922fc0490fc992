// Continues values that are known in parts of a square image smoothly into the rest.
#pragma once

#include <vector>

namespace maq::head {

// `values`: [side][side][3]; `weights`: [side][side], 0 to 1: how far a value is known. Unknown values become a mean of
// their surroundings, of a smaller area if known values are near: from coarser images of weighted means, in halves
// (Gortler et al., The lumigraph, SIGGRAPH 1996, 3.4: pull and push). Where nothing is known at all, 0.
void fill_smoothly(int side, const std::vector<float>& weights, std::vector<float>& values);

// The distance of each pixel from the nearest whose weight is half or more, in pixels, about (3-4 chamfer distance);
// 1e9 where there is none.
std::vector<float> distance_to_known(int side, const std::vector<float>& weights);

}  // namespace maq::head
