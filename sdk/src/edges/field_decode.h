// Converts the edge network's output to the field.
#pragma once

#include <vector>

#include "core/worker_threads.h"
#include "edges/depth_slopes.h"
#include "edges/edge_field.h"

namespace maq {

class FieldDecode {
 public:
  static constexpr int kChannels = 16;  // 4 planes of 2 x 2 pixels

  // Writes the planes of `field` inside `window`, whose sides are even; the size, eps_r and depth of the field are set.
  // `planes`: [height / 2][width / 2][kChannels], folded as the input is: distance / eps_r, logarithm of its spread
  // / eps_r, logits of crease and boundary. NaN becomes eps_r. Returns the number of NaN distances.
  int64_t write(const float* planes, const FieldWindow& window, WorkerThreads& threads, EdgeField& field);

 private:
  std::vector<float> rows_;  // scratch of each worker
  std::vector<int64_t> broken_;
};

// Fills the field outside `window` with the values far from edges or without depth.
void clear_outside(const FieldWindow& window, EdgeField& field);

}  // namespace maq
