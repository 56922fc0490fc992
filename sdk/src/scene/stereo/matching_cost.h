// How well a photo fits its neighbours at each depth: a sweep of planes (Collins, "A space-sweep approach to true
// multi-image matching", CVPR 1996).
#pragma once

#include <cstdint>
#include <vector>

#include "core/worker_threads.h"
#include "scene/stereo/stereo_photo.h"

namespace maq {

// Planes at right angles to the optical axis, at even steps of inverse depth.
struct DepthPlanes {
  static constexpr int kCount = 128;
  double near = 1, far = 1;  // depth of the last and of the first plane

  double inverse_depth(double plane) const { return 1 / far + plane * (1 / near - 1 / far) / (kCount - 1); }
};

// A byte for each pixel and plane, planes of a pixel side by side: 0 for equal patches to kWorst for patches without
// correlation.
class MatchingCost {
 public:
  static constexpr int kMaxNeighbours = 4;
  static constexpr uint8_t kWorst = 100;

  // Compares patches of 7 x 7 pixels by their correlation with the half of the neighbours that fit best: what one does
  // not see, another does. `neighbours`: 1 to kMaxNeighbours.
  void compute(const StereoPhoto& photo, const std::vector<const StereoPhoto*>& neighbours, const DepthPlanes& planes,
               WorkerThreads& threads);

  const uint8_t* pixel(int x, int y) const {
    return &costs_[(size_t(y) * size_t(width_px_) + size_t(x)) * DepthPlanes::kCount];
  }
  int width_px() const { return width_px_; }
  int height_px() const { return height_px_; }

 private:
  int width_px_ = 0, height_px_ = 0;
  std::vector<uint8_t> costs_;
  // Memory for one photo, kept for the next.
  std::vector<uint32_t> quads_[kMaxNeighbours];
  std::vector<float> scale_;
  std::vector<int32_t> sum_;
};

}  // namespace maq
