// Products of the channels of each pixel with a matrix of floats.
#pragma once

#include <vector>

#include "nn/portable/layer.h"

namespace maq {

// Has the bits of ONNX Runtime's MatMul and Gemm on processors with fused multiply-add: what boxes are computed from
// decides which pixels a person's surface is read from.
class MatrixProduct : public Layer {
 public:
  // weights[output][input]; `bias` may be empty.
  MatrixProduct(size_t inputs, size_t outputs, const std::vector<float>& weights, const std::vector<float>& bias);

  void set_bias(const std::vector<float>& bias);

  Extents output_extents(const std::vector<const Tensor*>& inputs) const override;
  void run(const std::vector<const Tensor*>& inputs, Tensor& output, WorkerThreads&) override;

 private:
  // Outputs from `first` on, 8 at most, of one pixel.
  void multiply(const float* from, size_t first, float* to) const;

  size_t inputs_, outputs_;
  std::vector<float> weights_;  // [block of 8 outputs][input][output]
  std::vector<float> bias_;
};

}  // namespace maq
