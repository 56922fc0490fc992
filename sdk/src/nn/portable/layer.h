// A step of a network that runs on this library's own kernels.
#pragma once

#include <memory>
#include <vector>

#include "nn/portable/tensor.h"

namespace maq {

class Layer {
 public:
  Layer() = default;
  virtual ~Layer() = default;
  Layer(const Layer&) = delete;
  Layer& operator=(const Layer&) = delete;

  // The size of the output. Inputs have the channels that the layer was made for, or it throws MAQ_ERROR_INFERENCE.
  virtual Extents output_extents(const std::vector<const Tensor*>& inputs) const = 0;
  virtual void run(const std::vector<const Tensor*>& inputs, Tensor& output) = 0;
};

}  // namespace maq
