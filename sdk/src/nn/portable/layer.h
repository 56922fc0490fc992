// Tensors, and the steps of a network that runs on this library's own kernels.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "core/worker_threads.h"

namespace maq {

// Sizes of a tensor in the order of its memory: images, rows, columns, channels.
using Extents = std::array<int, 4>;

inline size_t count_of(const Extents& extents) {
  size_t count = 1;
  for (const int extent : extents) count *= size_t(extent);
  return count;
}

// A tensor of a network, in memory of another owner. Quantized values are stored without their zero point, so that a
// zero is a zero also where images are padded, and with 16 bits, which are multiplied in pairs without widening.
struct Tensor {
  Extents extents{};
  int16_t* quantized = nullptr;  // or
  float* floats = nullptr;

  int rows() const { return extents[1]; }
  int columns() const { return extents[2]; }
  int channels() const { return extents[3]; }
  size_t pixels() const { return size_t(extents[0]) * size_t(extents[1]) * size_t(extents[2]); }
};

// How whole numbers stand for real ones: scale * (number - zero_point), for numbers from 0 to 255.
struct Quantization {
  float scale = 1;
  int zero_point = 0;

  // Limits of stored values, which are without the zero point.
  float lowest() const { return float(-zero_point); }
  float highest() const { return float(255 - zero_point); }
};

class Layer {
 public:
  Layer() = default;
  virtual ~Layer() = default;
  Layer(const Layer&) = delete;
  Layer& operator=(const Layer&) = delete;

  // The size of the output. Inputs have the channels that the layer was made for, or it throws MAQ_ERROR_INFERENCE.
  virtual Extents output_extents(const std::vector<const Tensor*>& inputs) const = 0;
  // The output is the same for any number of threads.
  virtual void run(const std::vector<const Tensor*>& inputs, Tensor& output, WorkerThreads& threads) = 0;
};

}  // namespace maq
