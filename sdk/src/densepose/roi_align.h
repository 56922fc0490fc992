// RoIAlign (He et al., Mask R-CNN, 2017; the "aligned" form with the half-pixel shift).
#pragma once

#include "densepose/box.h"

namespace maq {

struct FeatureMap {
  const float* data = nullptr;  // [height, width, channels]
  int channels = 0;
  int height = 0;
  int width = 0;
  int stride = 1;  // image pixels for one cell
};

// Pools `box` (in image pixels) into `output` [pool, pool, channels]. Each bin is the mean of ceil(bin size) bilinear
// samples each way, as with sampling_ratio 0; samples over one cell outside the map count as 0.
// The box must be finite.
void roi_align(const FeatureMap& map, const Box& box, int pool, float* output);

}  // namespace maq
