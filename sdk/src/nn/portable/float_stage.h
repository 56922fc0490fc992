// The layers of floats at the beginning of a network, and the quantization of what they compute.
#pragma once

#include <memory>
#include <vector>

#include "nn/portable/convolution.h"

namespace maq {

// Quantized networks amplify a single value that is rounded to the other side: a third of the features of an image
// changes by a step, and 0.8 % of its labels. ONNX Runtime's kernels round once for a product and a sum where the
// processor can (fused multiply-add), WebAssembly cannot. So values that are nearly between two steps are computed
// again with one rounding; they are 1 of 2,000.
class FloatStage : public Layer {
 public:
  FloatStage(std::vector<std::unique_ptr<FloatLayer>> layers, const Quantization& to);

  Extents output_extents(const std::vector<const Tensor*>& inputs) const override;
  void run(const std::vector<const Tensor*>& inputs, Tensor& output, WorkerThreads&) override;

 private:
  // An image of floats with its memory.
  struct Image {
    Tensor tensor;
    std::vector<float> values;

    void resize(const Extents& extents);
  };

  // Quantizes one pixel; says whether a value was nearly between two steps.
  bool quantize(const float* from, int16_t* to) const;
  // Computes one pixel of the output from the pixels of the input that it depends on. `windows` is memory.
  const float* compute_again(const Tensor& input, int image, int x, int y, std::vector<Image>& windows) const;

  std::vector<std::unique_ptr<FloatLayer>> layers_;
  Quantization to_;
  std::vector<Image> images_;  // the output of each layer
  // By thread, the same of one pixel of the last one; the first is of the input.
  std::vector<std::vector<Image>> windows_;
};

}  // namespace maq
