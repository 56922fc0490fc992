// Values that are known in parts of a square picture, continued smoothly into the rest of it.
#pragma once

#include <vector>

namespace maq::head {

// `values`: [side][side][3]; `weights`: [side][side], 0 to 1: how far a value is known. What is not known becomes a
// mean of what is around, of the smaller a surrounding the nearer that is: from coarser pictures of weighted means, in
// halves (Gortler et al., The lumigraph, SIGGRAPH 1996, 3.4: pull and push). Where nothing is known at all, 0.
void fill_smoothly(int side, const std::vector<float>& weights, std::vector<float>& values);

// The distance of each pixel from the nearest whose weight is half or more, in pixels, about (3-4 chamfer distance);
// 1e9 where there is none.
std::vector<float> distance_to_known(int side, const std::vector<float>& weights);

}  // namespace maq::head
