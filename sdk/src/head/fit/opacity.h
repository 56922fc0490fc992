// How opaque a ray is along its sections: NeuS (arXiv 2106.10689, equation 13) in its log form, with its derivatives.
#pragma once

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

  // Log transmittance of the whole ray, at most 0; never -infinity with finite distances.
  double log_transmittance() const { return log_transmittance_; }

  // Writes the loss's derivatives by each distance (`by_distances` [sections + 1]) from its derivative by
  // log_transmittance(). For the latest run.
  void back(double by_log_transmittance, float* by_distances) const;

 private:
  double sharpness_ = 1;
  double log_transmittance_ = 0;
  bool is_clear_ = true;  // so far outside that nothing of the ray is left in double: there is no work
  size_t sections_ = 0;
  std::vector<double> distances_, inside_;  // of ends; inside: sigmoid(-s f)
  std::vector<double> log_clear_;           // of sections: log(1 - alpha)
};

}  // namespace maq::head
