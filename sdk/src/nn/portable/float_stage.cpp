#include "nn/portable/float_stage.h"

#include <algorithm>
#include <utility>

#include "nn/portable/simd.h"

namespace maq {
namespace {

using namespace simd;

}  // namespace

FloatStage::FloatStage(std::vector<std::unique_ptr<FloatLayer>> layers, const Quantization& to)
    : layers_(std::move(layers)), to_(to), images_(layers_.size()) {}

void FloatStage::Image::resize(const Extents& extents) {
  if (values.size() < count_of(extents)) values.resize(count_of(extents));
  tensor.extents = extents;
  tensor.floats = values.data();
}

Extents FloatStage::output_extents(const std::vector<const Tensor*>& inputs) const {
  Tensor tensor = *inputs[0];
  for (const auto& layer : layers_) tensor.extents = layer->output_extents({&tensor});
  return tensor.extents;
}

void FloatStage::run(const std::vector<const Tensor*>& inputs, Tensor& output, WorkerThreads& threads) {
  const Tensor* from = inputs[0];
  for (size_t i = 0; i < layers_.size(); ++i) {
    images_[i].resize(layers_[i]->output_extents({from}));
    layers_[i]->run({from}, images_[i].tensor, threads);
    from = &images_[i].tensor;
  }
  const size_t channels = size_t(output.channels());
  windows_.resize(size_t(threads.count()));
  threads.run(size_t(output.extents[0]) * size_t(output.rows()), [&](size_t row, int thread) {
    const int image = int(row) / output.rows(), y = int(row) % output.rows();
    size_t at = row * size_t(output.columns()) * channels;
    for (int x = 0; x < output.columns(); ++x, at += channels) {
      if (!quantize(from->floats + at, output.quantized + at)) continue;
      quantize(compute_again(*inputs[0], image, x, y, windows_[size_t(thread)]), output.quantized + at);
    }
  });
}

bool FloatStage::quantize(const float* from, int16_t* to) const {
  const size_t channels = size_t(layers_.back()->output_channels());
  const Floats scale = repeat(to_.scale), lowest = repeat(to_.lowest()), highest = repeat(to_.highest());
  bool is_near = false;
  for (size_t i = 0; i < channels; i += 8) {
    Floats values[2];
    Ints rounded[2];
    for (size_t half = 0; half < 2; ++half) {
      values[half] = at_most(at_least(divide(load(from + i + 4 * half), scale), lowest), highest);
      rounded[half] = round_to_ints(values[half]);
      // The values of both ways of rounding differed by up to 0.00017 on photos, in the shipped network.
      is_near = is_near || is_nearly_between(values[half], rounded[half]);
    }
    store(to + i, narrow(rounded[0], rounded[1]));
  }
  return is_near;
}

const float* FloatStage::compute_again(const Tensor& input, int image, int x, int y,
                                       std::vector<Image>& windows) const {
  const size_t count = layers_.size();
  windows.resize(count + 1);
  // Left and top of the window in the input of each layer, and its size, from the last layer back.
  std::vector<int> left(count + 1, x), top(count + 1, y), width(count + 1, 1), height(count + 1, 1);
  for (size_t i = count; i-- > 0;) {
    const Windows& of = layers_[i]->windows();
    left[i] = left[i + 1] * of.stride - of.left;
    top[i] = top[i + 1] * of.stride - of.top;
    width[i] = (width[i + 1] - 1) * of.stride + of.dilation * (of.columns - 1) + 1;
    height[i] = (height[i + 1] - 1) * of.stride + of.dilation * (of.rows - 1) + 1;
  }
  for (size_t i = 0; i <= count; ++i) {
    const Extents& whole = i == 0 ? input.extents : images_[i - 1].tensor.extents;
    const size_t channels = size_t(whole[3]);
    Image& window = windows[i];
    window.resize({1, height[i], width[i], whole[3]});
    if (i > 0) layers_[i - 1]->run_like_onnxruntime(windows[i - 1].tensor, window.tensor);
    float* to = window.values.data();
    for (int row = top[i]; row < top[i] + height[i]; ++row) {
      for (int column = left[i]; column < left[i] + width[i]; ++column, to += channels) {
        if (row < 0 || row >= whole[1] || column < 0 || column >= whole[2]) {
          std::fill_n(to, channels, 0.0f);  // padding
        } else if (i == 0) {
          const size_t line = size_t(image) * size_t(whole[1]) + size_t(row);
          std::copy_n(input.floats + (line * size_t(whole[2]) + size_t(column)) * channels, channels, to);
        }
      }
    }
  }
  return windows[count].values.data();
}

}  // namespace maq
