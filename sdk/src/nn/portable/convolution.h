// Convolutions, quantized and of floats, of images whose channels are neighbours in memory.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "nn/portable/layer.h"

namespace maq {

// Where the windows of a convolution are.
struct Windows {
  int rows = 1, columns = 1;
  int stride = 1, dilation = 1;
  int top = 0, left = 0, bottom = 0, right = 0;  // padding, of zeros

  int taps() const { return rows * columns; }
  int output_rows(int input_rows) const { return (input_rows + top + bottom - dilation * (rows - 1) - 1) / stride + 1; }
  int output_columns(int input_columns) const {
    return (input_columns + left + right - dilation * (columns - 1) - 1) / stride + 1;
  }
};

// The addresses that the taps of some output pixels read from; those outside of the image read zeros.
template <class Value>
class TapAddresses {
 public:
  TapAddresses(const Windows& windows, int channels) : windows_(windows), zeros_(size_t(channels)) {}

  // For this many threads.
  void prepare(int threads) { addresses_.resize(size_t(threads)); }

  // Returns the addresses for `count` pixels from `first` on, counted through all images, in memory of the thread with
  // that number. Pixels beyond the last read zeros.
  // at()[tap * count + pixel]
  const Value* const* at(const Value* image, const Extents& input, const Extents& output, size_t first, size_t count,
                         int thread);

 private:
  Windows windows_;
  std::vector<Value> zeros_;
  std::vector<std::vector<const Value*>> addresses_;
};

// Sums of products with 8 bits, and their quantization. The results equal those that ONNX Runtime's QLinearConv gives.
class QuantizedConvolution : public Layer {
 public:
  // weights[output channel][input channel][row][column]; bias may be empty. scales[output channel] multiplies sums.
  QuantizedConvolution(const Windows& windows, int inputs, int outputs, const std::vector<int8_t>& weights,
                       const std::vector<int32_t>& bias, const std::vector<float>& scales, const Quantization& to);

  Extents output_extents(const std::vector<const Tensor*>& inputs) const override;
  void run(const std::vector<const Tensor*>& inputs, Tensor& output, WorkerThreads&) override;

 private:
  Windows windows_;
  int inputs_, outputs_;
  Quantization to_;
  std::vector<int16_t> weights_;  // [block of 8 outputs][tap][pair of inputs][output][2]
  std::vector<int32_t> bias_;
  std::vector<float> scales_;
  TapAddresses<int16_t> addresses_;
};

// The same where each channel has a window of its own.
class QuantizedDepthwise : public Layer {
 public:
  // weights[channel][row][column]. A multiple of 8 channels.
  QuantizedDepthwise(const Windows& windows, int channels, const std::vector<int8_t>& weights,
                     const std::vector<int32_t>& bias, const std::vector<float>& scales, const Quantization& to);

  Extents output_extents(const std::vector<const Tensor*>& inputs) const override;
  void run(const std::vector<const Tensor*>& inputs, Tensor& output, WorkerThreads&) override;

 private:
  Windows windows_;
  int channels_;
  Quantization to_;
  std::vector<int16_t> weights_;  // [block of 8 channels][pair of taps][low, high][channel][2]
  std::vector<int32_t> bias_;
  std::vector<float> scales_;
  TapAddresses<int16_t> addresses_;
};

// Limits of what a layer of floats writes.
struct FloatRange {
  float lowest = -3.4e38f, highest = 3.4e38f;
};

// A convolution of floats. run() multiplies, rounds, adds and rounds again, because WebAssembly has no fused
// instruction.
class FloatLayer : public Layer {
 public:
  explicit FloatLayer(const Windows& windows) : windows_(windows) {}

  const Windows& windows() const { return windows_; }
  void set_range(const FloatRange& range) { range_ = range; }

  // Computes output pixels from exactly the input pixels of their windows, without padding. Rounds once for a product
  // and a sum, in the order of ONNX Runtime's kernels for processors that do so: the values are theirs to the last bit.
  virtual void run_like_onnxruntime(const Tensor& input, Tensor& output) const = 0;
  virtual int output_channels() const = 0;

 protected:
  Windows windows_;
  FloatRange range_;
};

class FloatConvolution : public FloatLayer {
 public:
  // weights[output channel][input channel][row][column]; bias may be empty.
  FloatConvolution(const Windows& windows, int inputs, int outputs, const std::vector<float>& weights,
                   const std::vector<float>& bias);

  Extents output_extents(const std::vector<const Tensor*>& inputs) const override;
  void run(const std::vector<const Tensor*>& inputs, Tensor& output, WorkerThreads&) override;
  void run_like_onnxruntime(const Tensor& input, Tensor& output) const override;
  int output_channels() const override { return outputs_; }

 private:
  int inputs_, outputs_;
  std::vector<float> weights_;  // [block of 8 outputs][tap][input][output]
  std::vector<float> bias_;
  TapAddresses<float> addresses_;
};

class FloatDepthwise : public FloatLayer {
 public:
  // weights[channel][row][column]. A multiple of 4 channels.
  FloatDepthwise(const Windows& windows, int channels, const std::vector<float>& weights,
                 const std::vector<float>& bias);

  Extents output_extents(const std::vector<const Tensor*>& inputs) const override;
  void run(const std::vector<const Tensor*>& inputs, Tensor& output, WorkerThreads&) override;
  void run_like_onnxruntime(const Tensor& input, Tensor& output) const override;
  int output_channels() const override { return channels_; }

 private:
  int channels_;
  std::vector<float> weights_;  // [tap][channel]
  std::vector<float> bias_;
  TapAddresses<float> addresses_;
};

}  // namespace maq
