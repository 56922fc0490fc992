// How opaque a ray is along its sections: NeuS (arXiv 2106.10689, equation 13) in its log form, with all derivatives.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

namespace maq::head {

// With f0 and f1 the signed distances (dm) at the ends of a section, outside to inside along the ray, and s the
// sharpness (1/dm):
//   log(1 - alpha) = min(0, softplus(-s f0) - softplus(-s f1))
// so that transmittance is the exponential of a sum. Unlike the paper's quotient of sigmoids with 1e-5 added, it is
// exact from s = 1 to 1e5, deep inside and far outside, and it needs no clamp. Memory is kept from ray to ray.
class RayOpacity {
 public:
  // Distances at the `sections` + 1 ends, in the order of the ray. Sections with an end that is not finite are clear.
  // `sharpness` is positive and finite.
  void run(const float* distances, size_t sections, double sharpness);

  // [sections]: the transmittance before each times its alpha.
  const std::vector<float>& weights() const { return weights_; }
  // Log transmittance of the whole ray, at most 0; never -infinity with finite distances.
  double log_transmittance() const { return log_transmittance_; }
  double opacity() const;  // the sum of the weights

  // Converts the loss's derivatives by each weight and by log_transmittance() to derivatives by each distance
  // (`by_distances` [sections + 1], overwritten) and by the sharpness (added). Of the latest run.
  void back(const float* by_weights, double by_log_transmittance, float* by_distances, double& by_sharpness) const;

  // All of the ray is so far outside that nothing of it is left in double: weights and derivatives are 0 without work.
  bool is_clear() const { return is_clear_; }

 private:
  double sharpness_ = 1;
  double log_transmittance_ = 0;
  bool is_clear_ = true;
  std::vector<float> weights_;
  std::vector<double> distances_, inside_;  // of ends; inside: sigmoid(-s f)
  std::vector<double> log_clear_, after_;   // of sections: log(1 - alpha), transmittance behind it
};

// The colour of a ray: the sum of weights times colours [sections][3]. The caller adds the background.
std::array<float, 3> blend_colours(const std::vector<float>& weights, const float* colours);

// Converts the loss's derivative by that colour to derivatives by the colours (overwritten) and by the weights (added).
void blend_colours_back(const std::vector<float>& weights, const float* colours, const std::array<float, 3>& by_colour,
                        float* by_colours, float* by_weights);

// Cross entropy of a ray's opacity with the matte (0..1) of its pixel. Logarithms end at -100, with a derivative of 0
// there; `is_clamped` says so where it counts. A matte that is not a number has no loss and is clamped.
struct MatteTerm {
  double loss = 0;
  double by_log_transmittance = 0;
  bool is_clamped = false;
};
MatteTerm matte_cross_entropy(double log_transmittance, double matte);

}  // namespace maq::head
