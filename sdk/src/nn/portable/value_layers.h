// Layers that compute each value by itself, or move values.
#pragma once

#include <cstdint>
#include <vector>

#include "nn/portable/convolution.h"
#include "nn/portable/layer.h"

namespace maq {

// Makes neighbours of the channels: [image][channel][row][column] becomes [image][row][column][channel].
class ChannelsLast : public Layer {
 public:
  Extents output_extents(const std::vector<const Tensor*>& inputs) const override;
  void run(const std::vector<const Tensor*>& inputs, Tensor& output, WorkerThreads&) override;
};

// Floats to quantized values, like ONNX Runtime's QuantizeLinear.
class Quantize : public Layer {
 public:
  explicit Quantize(const Quantization& to) : to_(to) {}
  Extents output_extents(const std::vector<const Tensor*>& inputs) const override { return inputs[0]->extents; }
  void run(const std::vector<const Tensor*>& inputs, Tensor& output, WorkerThreads&) override;

 private:
  Quantization to_;
};

class Dequantize : public Layer {
 public:
  explicit Dequantize(float scale) : scale_(scale) {}
  Extents output_extents(const std::vector<const Tensor*>& inputs) const override { return inputs[0]->extents; }
  void run(const std::vector<const Tensor*>& inputs, Tensor& output, WorkerThreads&) override;

 private:
  float scale_;
};

// Quantized values of another quantization.
class Requantize : public Layer {
 public:
  Requantize(const Quantization& from, const Quantization& to) : from_(from), to_(to) {}
  Extents output_extents(const std::vector<const Tensor*>& inputs) const override { return inputs[0]->extents; }
  void run(const std::vector<const Tensor*>& inputs, Tensor& output, WorkerThreads&) override;

 private:
  Quantization from_, to_;
};

// Sums of two quantized tensors, like ONNX Runtime's QLinearAdd. The second may have one pixel for all of the first's.
class QuantizedSum : public Layer {
 public:
  QuantizedSum(const Quantization& a, const Quantization& b, const Quantization& to) : a_(a), b_(b), to_(to) {}
  Extents output_extents(const std::vector<const Tensor*>& inputs) const override;
  void run(const std::vector<const Tensor*>& inputs, Tensor& output, WorkerThreads&) override;

 private:
  Quantization a_, b_, to_;
};

// Sums of two tensors of floats.
class FloatSum : public Layer {
 public:
  void set_range(const FloatRange& range) { range_ = range; }
  Extents output_extents(const std::vector<const Tensor*>& inputs) const override;
  void run(const std::vector<const Tensor*>& inputs, Tensor& output, WorkerThreads&) override;

 private:
  FloatRange range_;
};

// The mean of each channel of an image.
class QuantizedMean : public Layer {
 public:
  QuantizedMean(const Quantization& from, const Quantization& to) : from_(from), to_(to) {}
  Extents output_extents(const std::vector<const Tensor*>& inputs) const override;
  void run(const std::vector<const Tensor*>& inputs, Tensor& output, WorkerThreads&) override;

 private:
  Quantization from_, to_;
};

// Every `stride`-th row and column.
class Subsample : public Layer {
 public:
  explicit Subsample(int stride) : stride_(stride) {}
  Extents output_extents(const std::vector<const Tensor*>& inputs) const override;
  void run(const std::vector<const Tensor*>& inputs, Tensor& output, WorkerThreads&) override;

 private:
  int stride_;
};

// Tensors one after another along an axis of the memory's order.
class Concatenation : public Layer {
 public:
  explicit Concatenation(size_t axis) : axis_(axis) {}
  Extents output_extents(const std::vector<const Tensor*>& inputs) const override;
  void run(const std::vector<const Tensor*>& inputs, Tensor& output, WorkerThreads&) override;

 private:
  size_t axis_;
};

// The same values with other extents. Of the extents that are given, 0 keeps the input's and -1 takes the rest. Without
// any given, the extents of the second input count.
class Reshape : public Layer {
 public:
  explicit Reshape(std::vector<int64_t> extents) : extents_(std::move(extents)) {}
  Extents output_extents(const std::vector<const Tensor*>& inputs) const override;
  void run(const std::vector<const Tensor*>& inputs, Tensor& output, WorkerThreads&) override;

 private:
  std::vector<int64_t> extents_;
};

}  // namespace maq
