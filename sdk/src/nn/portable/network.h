// A network on this library's own kernels, for systems without ONNX Runtime.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "nn/portable/layer.h"

namespace maq {

// A layer with the numbers of its tensors.
struct Step {
  std::unique_ptr<Layer> layer;
  std::vector<int> inputs;
  int output = 0;
};

// The layers of an ONNX graph (network_builder.h).
struct NetworkPlan {
  std::vector<Step> steps;
  std::vector<bool> is_float;        // of each tensor
  std::vector<int> inputs, outputs;  // tensors of floats
};

class PortableNetwork {
 public:
  explicit PortableNetwork(NetworkPlan plan);

  // Inputs and outputs in the order of the graph; `outputs` point to memory for the values of their extents, with
  // sizes of 1 where a shape has fewer than four. Throws MAQ_ERROR_INFERENCE where an output has other extents.
  void run(const std::vector<Tensor>& inputs, const std::vector<Tensor>& outputs, WorkerThreads& threads);

 private:
  // Gives tensors that are not needed at the same time the same memory.
  void plan_memory();

  NetworkPlan plan_;
  std::vector<Tensor> tensors_;
  std::vector<int> memory_of_;  // of each tensor; -1: the caller's
  std::vector<std::vector<unsigned char>> memories_;
  std::vector<const Tensor*> step_inputs_;
};

}  // namespace maq
