// Coverage of a rendered image's pixels by points, and their depth: both from the nearest points at five scales, since
// a surface seen from near has holes between its points.
#pragma once

#include <cstdint>
#include <vector>

#include "core/worker_threads.h"
#include "scene/render/descriptor_raster.h"

namespace maq {

class Coverage {
 public:
  // Finds the coverage of the raster's window, which has that size.
  void find(const DescriptorRaster& raster, int width_px, int height_px, WorkerThreads& threads);

  // Confidence that a pixel shows the scene, 0..255, row by row: 255 where there is a point in the 4x4 pixels (2x2, 1)
  // that it is in, half of it in the 8x8, a quarter in the 16x16; from each scale to the next finer one bilinearly, so
  // that it has no steps, and the maximum of all scales counts.
  const uint8_t* alphas() const { return alphas_[0].data(); }
  // Depth of the nearest point at the finest scale that has one there, along the optical axis; 0 where there is none.
  const float* depths() const { return depths_[0].data(); }

 private:
  std::vector<uint8_t> alphas_[DescriptorRaster::kLevels];
  std::vector<float> depths_[DescriptorRaster::kLevels];
  std::vector<std::vector<uint16_t>> rows_;  // one for each worker
};

}  // namespace maq
