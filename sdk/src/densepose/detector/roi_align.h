// RoIAlign (He et al., Mask R-CNN, 2017; the "aligned" form with the half-pixel shift).
#pragma once

#include <vector>

#include "densepose/detector/box.h"

namespace maq {

struct FeatureMap {
  const float* data = nullptr;  // [height, width, channels]
  int channels = 0;
  int height = 0;
  int width = 0;
  int stride = 1;  // image pixels for one cell
};

class RoiAlign {
 public:
  // Pools `box` (in image pixels) into `output` [pool, pool, channels]. Each bin is the mean of ceil(bin size) bilinear
  // samples each way, as with sampling_ratio 0; samples over one cell outside the map count as 0.
  // The box must be finite. Memory is kept from call to call.
  void run(const FeatureMap& map, const Box& box, int pool, float* output);

  // Bilinear samples, their mean over a bin and the zero outside of the map all separate into rows and columns, so a
  // RoI is A_y F A_x^T with two sparse matrices. This is one of them: for each bin, the cells it draws on and their
  // weights.
  struct AxisWeights {
    struct Bin {
      int first_cell = 0;
      size_t first_weight = 0;
      size_t count = 0;  // of cells from first_cell on; 0 when the bin lies outside of the map
    };
    std::vector<Bin> bins;
    std::vector<float> weights;
    int first_cell = 0;  // over all bins
    int end_cell = 0;
  };

 private:
  AxisWeights rows_, columns_;
  std::vector<float> line_;
};

}  // namespace maq
