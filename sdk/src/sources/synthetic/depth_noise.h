// Models the errors of depth cameras: noise, and pixels without depth. Pixel by pixel a function of the seed, the
// frame and the depth alone, with the same bits on every processor.
#pragma once

#include <cstdint>
#include <vector>

#include "sources/synthetic/solids_scene.h"

namespace maq {

class DepthNoise {
 public:
  // "none", "stereo" (errors of disparity, steps, fattened foreground, half-occlusion) or "tof" (errors that grow with
  // the range, mixed pixels at jumps). docs/reference/cameras/simulated.md has the numbers. Throws
  // MAQ_ERROR_INVALID_ARGUMENT for another name.
  DepthNoise(const std::string& name, uint64_t seed);

  // Applies the noise to exact depth.
  void apply(const SolidsPicture& picture, uint64_t frame, float* metres);

 private:
  enum class Kind { kNone, kStereo, kTimeOfFlight };

  void see_by_stereo(const SolidsPicture& picture, float* metres);
  void see_by_light(const SolidsPicture& picture, float* metres);
  // From 0 to below 1, for the `use`th time at that pixel.
  double uniform(size_t pixel, uint64_t use) const;
  // Returns a number of mean 0 and variance 1, within 3.5 of 0.
  double normal(size_t pixel) const;

  Kind kind_;
  uint64_t seed_, frame_seed_ = 0;
  std::vector<float> before_, errors_;  // kept between frames
};

}  // namespace maq
