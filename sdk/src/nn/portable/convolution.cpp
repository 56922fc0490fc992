#include "nn/portable/convolution.h"

#include <algorithm>
#include <array>

#include "core/error.h"
#include "nn/portable/simd.h"

namespace maq {
namespace {

using namespace simd;

constexpr size_t kTile = 4;    // output pixels that a step computes at once
constexpr size_t kTiles = 32;  // tiles whose inputs stay in the cache while the weights of 8 outputs are used
constexpr size_t kPixels = kTile * kTiles;
constexpr int kBlock = 8;                // output channels of a step
constexpr size_t kDepthwisePixels = 32;  // of a task, which has few products for each pixel
// Products of a task that is worth waking a thread up: some 20 microseconds.
constexpr size_t kProducts = 100000;

int blocks_of(int channels) { return (channels + kBlock - 1) / kBlock; }

template <class Value>
std::vector<Value> padded(std::vector<Value> values, int outputs) {
  values.resize(size_t(blocks_of(outputs)) * kBlock);
  return values;
}

Extents convolved(const Windows& windows, const Tensor& input, int inputs, int outputs) {
  const Extents extents{input.extents[0], windows.output_rows(input.rows()), windows.output_columns(input.columns()),
                        outputs};
  if (input.channels() != inputs || extents[1] < 1 || extents[2] < 1) {
    throw Error(MAQ_ERROR_INFERENCE, "A convolution of ", inputs, " channels got an image of ", input.columns(), " x ",
                input.rows(), " pixels with ", input.channels(), " channels.");
  }
  return extents;
}

// 8 sums as quantized values.
inline Ints quantize(Ints low, Ints high, const float* scales, const Quantization& to) {
  const Floats lowest = repeat(to.lowest()), highest = repeat(to.highest());
  const Floats first = at_most(at_least(multiply(to_floats(low), load(scales)), lowest), highest);
  const Floats second = at_most(at_least(multiply(to_floats(high), load(scales + 4)), lowest), highest);
  return narrow(round_to_ints(first), round_to_ints(second));
}

// Cuts a layer into tasks and calls work(first pixel, pixels, first block, end of blocks, thread) for each. A task has
// `part_pixels` pixels and all blocks of output channels; if the layer has few pixels, a task has some of the blocks.
// `products`: how many the whole layer computes.
template <class Work>
void share(WorkerThreads& threads, size_t pixels, size_t part_pixels, int blocks, size_t products, Work&& work) {
  const size_t parts = (pixels + part_pixels - 1) / part_pixels;
  const size_t wanted = std::min(4 * size_t(threads.count()), products / kProducts);
  const size_t groups = threads.count() == 1 ? 1 : std::clamp((wanted + parts - 1) / parts, size_t(1), size_t(blocks));
  const auto run = [&](size_t task, int thread) {
    const size_t part = task / groups, group = task % groups, first = part * part_pixels;
    work(first, std::min(part_pixels, pixels - first), int(size_t(blocks) * group / groups),
         int(size_t(blocks) * (group + 1) / groups), thread);
  };
  const size_t tasks = parts * groups;
  if (wanted > 1) {
    threads.run(tasks, [&](size_t task, int thread) { run(task, thread); });
  } else {
    for (size_t task = 0; task < tasks; ++task) run(task, 0);
  }
}

using Block = std::array<float, kBlock>;

// The pixel that a tap of an output pixel reads, in an image without padding.
const float* value_at(const Tensor& input, const Windows& windows, int x, int y, size_t tap) {
  const int row = y * windows.stride + int(tap) / windows.columns * windows.dilation;
  const int column = x * windows.stride + int(tap) % windows.columns * windows.dilation;
  return input.floats + (size_t(row) * size_t(input.columns()) + size_t(column)) * size_t(input.channels());
}

}  // namespace

template <class Value>
const Value* const* TapAddresses<Value>::at(const Value* image, const Extents& input, const Extents& output,
                                            size_t first, size_t count, int thread) {
  const size_t taps = size_t(windows_.taps());
  std::vector<const Value*>& addresses = addresses_[size_t(thread)];
  addresses.assign(taps * count, zeros_.data());
  const size_t columns = size_t(output[2]), pixels = size_t(output[1]) * columns;
  const size_t channels = size_t(input[3]), image_size = size_t(input[1]) * size_t(input[2]) * channels;
  const size_t last = std::min(first + count, size_t(output[0]) * pixels);
  for (size_t pixel = first; pixel < last; ++pixel) {
    const size_t number = pixel / pixels, place = pixel % pixels;
    const int top = int(place / columns) * windows_.stride - windows_.top;
    const int left = int(place % columns) * windows_.stride - windows_.left;
    const Value** to = addresses.data() + (pixel - first);
    for (int row = 0; row < windows_.rows; ++row) {
      const int y = top + row * windows_.dilation;
      for (int column = 0; column < windows_.columns; ++column, to += count) {
        const int x = left + column * windows_.dilation;
        if (y < 0 || y >= input[1] || x < 0 || x >= input[2]) continue;
        *to = image + number * image_size + (size_t(y) * size_t(input[2]) + size_t(x)) * channels;
      }
    }
  }
  return addresses.data();
}

QuantizedConvolution::QuantizedConvolution(const Windows& windows, int inputs, int outputs,
                                           const std::vector<int8_t>& weights, const std::vector<int32_t>& bias,
                                           const std::vector<float>& scales, const Quantization& to)
    : windows_(windows),
      inputs_(inputs),
      outputs_(outputs),
      to_(to),
      bias_(padded(bias, outputs)),
      scales_(padded(scales, outputs)),
      addresses_(windows, inputs) {
  const size_t taps = size_t(windows.taps());
  weights_.resize(size_t(blocks_of(outputs)) * kBlock * taps * size_t(inputs));
  for (int output = 0; output < outputs; ++output) {
    for (int input = 0; input < inputs; ++input) {
      for (size_t tap = 0; tap < taps; ++tap) {
        const size_t block = size_t(output) / kBlock, pair = size_t(input) / 2;
        const size_t place = ((block * taps + tap) * size_t(inputs) / 2 + pair) * kBlock + size_t(output) % kBlock;
        // Weights are numbers, not characters.
        const size_t from = (size_t(output) * size_t(inputs) + size_t(input)) * taps + tap;
        weights_[2 * place + size_t(input) % 2] = weights[from];  // NOLINT(bugprone-signed-char-misuse)
      }
    }
  }
}

Extents QuantizedConvolution::output_extents(const std::vector<const Tensor*>& inputs) const {
  return convolved(windows_, *inputs[0], inputs_, outputs_);
}

void QuantizedConvolution::run(const std::vector<const Tensor*>& inputs, Tensor& output, WorkerThreads& threads) {
  const Tensor& input = *inputs[0];
  const int taps = windows_.taps();
  const size_t pixels = output.pixels(), block_weights = size_t(taps) * size_t(inputs_) * kBlock;
  const int blocks = blocks_of(outputs_);
  addresses_.prepare(threads.count());
  share(threads, pixels, kPixels, blocks, pixels * size_t(blocks) * block_weights,
        [&](size_t first, size_t part, int first_block, int end_block, int thread) {
          const size_t count = (part + kTile - 1) / kTile * kTile;
          const int16_t* const* addresses =
              addresses_.at(input.quantized, input.extents, output.extents, first, count, thread);
          for (int block = first_block; block < end_block; ++block) {
            const int32_t* bias = bias_.data() + kBlock * block;
            const Ints bias_low = load(bias), bias_high = load(bias + 4);
            for (size_t tile = 0; tile < count; tile += kTile) {
              Ints a0 = bias_low, a1 = bias_low, a2 = bias_low, a3 = bias_low;
              Ints b0 = bias_high, b1 = bias_high, b2 = bias_high, b3 = bias_high;
              const int16_t* weights = weights_.data() + size_t(block) * block_weights;
              for (int tap = 0; tap < taps; ++tap) {
                const int16_t* const* from = addresses + size_t(tap) * count + tile;
                const int16_t *p0 = from[0], *p1 = from[1], *p2 = from[2], *p3 = from[3];
                for (int channel = 0; channel < inputs_; channel += 2, weights += 2 * kBlock) {
                  const Ints low = load(weights), high = load(weights + 8);
                  const Ints v0 = repeat_pair(p0 + channel), v1 = repeat_pair(p1 + channel);
                  a0 = add_ints(a0, multiply_pairs(v0, low));
                  b0 = add_ints(b0, multiply_pairs(v0, high));
                  a1 = add_ints(a1, multiply_pairs(v1, low));
                  b1 = add_ints(b1, multiply_pairs(v1, high));
                  const Ints v2 = repeat_pair(p2 + channel), v3 = repeat_pair(p3 + channel);
                  a2 = add_ints(a2, multiply_pairs(v2, low));
                  b2 = add_ints(b2, multiply_pairs(v2, high));
                  a3 = add_ints(a3, multiply_pairs(v3, low));
                  b3 = add_ints(b3, multiply_pairs(v3, high));
                }
              }
              const float* scales = scales_.data() + kBlock * block;
              const Ints rows[kTile] = {quantize(a0, b0, scales, to_), quantize(a1, b1, scales, to_),
                                        quantize(a2, b2, scales, to_), quantize(a3, b3, scales, to_)};
              const int channels = std::min(kBlock, outputs_ - kBlock * block);
              for (size_t i = 0; i < kTile && first + tile + i < pixels; ++i) {
                int16_t* to = output.quantized + (first + tile + i) * size_t(outputs_) + size_t(kBlock * block);
                if (channels == kBlock) {
                  store(to, rows[i]);
                } else {
                  int16_t values[kBlock];
                  store(values, rows[i]);
                  std::copy_n(values, channels, to);
                }
              }
            }
          }
        });
}

QuantizedDepthwise::QuantizedDepthwise(const Windows& windows, int channels, const std::vector<int8_t>& weights,
                                       const std::vector<int32_t>& bias, const std::vector<float>& scales,
                                       const Quantization& to)
    : windows_(windows),
      channels_(channels),
      to_(to),
      bias_(padded(bias, channels)),
      scales_(padded(scales, channels)),
      addresses_(windows, channels) {
  const size_t taps = size_t(windows.taps()), pairs = (taps + 1) / 2;
  weights_.resize(size_t(channels) * 2 * pairs);
  for (size_t channel = 0; channel < size_t(channels); ++channel) {
    for (size_t tap = 0; tap < taps; ++tap) {
      const size_t place = (channel / kBlock * pairs + tap / 2) * kBlock + channel % kBlock;
      weights_[2 * place + tap % 2] = weights[channel * taps + tap];  // NOLINT(bugprone-signed-char-misuse)
    }
  }
}

Extents QuantizedDepthwise::output_extents(const std::vector<const Tensor*>& inputs) const {
  return convolved(windows_, *inputs[0], channels_, channels_);
}

void QuantizedDepthwise::run(const std::vector<const Tensor*>& inputs, Tensor& output, WorkerThreads& threads) {
  const Tensor& input = *inputs[0];
  const size_t taps = size_t(windows_.taps()), pixels = output.pixels(), products = pixels * taps * size_t(channels_);
  addresses_.prepare(threads.count());
  share(threads, pixels, kDepthwisePixels, 1, products, [&](size_t first, size_t count, int, int, int thread) {
    const int16_t* const* addresses =
        addresses_.at(input.quantized, input.extents, output.extents, first, count, thread);
    int16_t* to = output.quantized + first * size_t(channels_);
    for (size_t pixel = 0; pixel < count; ++pixel, to += channels_) {
      const int16_t* const* from = addresses + pixel;
      const int16_t* weights = weights_.data();
      for (int channel = 0; channel < channels_; channel += kBlock) {
        Ints low = load(bias_.data() + channel), high = load(bias_.data() + channel + 4);
        for (size_t tap = 0; tap < taps; tap += 2, weights += 2 * kBlock) {
          const Ints a = load(from[tap * count] + channel);
          const Ints b = tap + 1 < taps ? load(from[(tap + 1) * count] + channel) : zeros();
          low = add_ints(low, multiply_pairs(interleave_low(a, b), load(weights)));
          high = add_ints(high, multiply_pairs(interleave_high(a, b), load(weights + 8)));
        }
        store(to + channel, quantize(low, high, scales_.data() + channel, to_));
      }
    }
  });
}

FloatConvolution::FloatConvolution(const Windows& windows, int inputs, int outputs, const std::vector<float>& weights,
                                   const std::vector<float>& bias)
    : FloatLayer(windows),
      inputs_(inputs),
      outputs_(outputs),
      bias_(padded(bias, outputs)),
      addresses_(windows, inputs) {
  const size_t taps = size_t(windows.taps());
  weights_.resize(size_t(blocks_of(outputs)) * kBlock * taps * size_t(inputs));
  for (size_t output = 0; output < size_t(outputs); ++output) {
    for (size_t input = 0; input < size_t(inputs); ++input) {
      for (size_t tap = 0; tap < taps; ++tap) {
        const size_t step = (output / kBlock * taps + tap) * size_t(inputs) + input;
        weights_[step * kBlock + output % kBlock] = weights[(output * size_t(inputs) + input) * taps + tap];
      }
    }
  }
}

Extents FloatConvolution::output_extents(const std::vector<const Tensor*>& inputs) const {
  return convolved(windows_, *inputs[0], inputs_, outputs_);
}

void FloatConvolution::run(const std::vector<const Tensor*>& inputs, Tensor& output, WorkerThreads& threads) {
  const Tensor& input = *inputs[0];
  const int taps = windows_.taps();
  const size_t pixels = output.pixels(), block_weights = size_t(taps) * size_t(inputs_) * kBlock;
  const Floats lowest = repeat(range_.lowest), highest = repeat(range_.highest);
  const int blocks = blocks_of(outputs_);
  addresses_.prepare(threads.count());
  share(threads, pixels, kPixels, blocks, pixels * size_t(blocks) * block_weights,
        [&](size_t first, size_t part, int first_block, int end_block, int thread) {
          const size_t count = (part + kTile - 1) / kTile * kTile;
          const float* const* addresses =
              addresses_.at(input.floats, input.extents, output.extents, first, count, thread);
          for (int block = first_block; block < end_block; ++block) {
            const float* bias = bias_.data() + kBlock * block;
            const Floats bias_low = load(bias), bias_high = load(bias + 4), zero = repeat(0.0f);
            for (size_t tile = 0; tile < count; tile += kTile) {
              Floats a0 = zero, a1 = zero, a2 = zero, a3 = zero;
              Floats b0 = zero, b1 = zero, b2 = zero, b3 = zero;
              const float* weights = weights_.data() + size_t(block) * block_weights;
              for (int tap = 0; tap < taps; ++tap) {
                const float* const* from = addresses + size_t(tap) * count + tile;
                const float *p0 = from[0], *p1 = from[1], *p2 = from[2], *p3 = from[3];
                for (int channel = 0; channel < inputs_; ++channel, weights += kBlock) {
                  const Floats low = load(weights), high = load(weights + 4);
                  const Floats v0 = repeat(p0 + channel), v1 = repeat(p1 + channel);
                  a0 = add(a0, multiply(v0, low));
                  b0 = add(b0, multiply(v0, high));
                  a1 = add(a1, multiply(v1, low));
                  b1 = add(b1, multiply(v1, high));
                  const Floats v2 = repeat(p2 + channel), v3 = repeat(p3 + channel);
                  a2 = add(a2, multiply(v2, low));
                  b2 = add(b2, multiply(v2, high));
                  a3 = add(a3, multiply(v3, low));
                  b3 = add(b3, multiply(v3, high));
                }
              }
              const Floats rows[kTile][2] = {{a0, b0}, {a1, b1}, {a2, b2}, {a3, b3}};
              const int channels = std::min(kBlock, outputs_ - kBlock * block);
              for (size_t i = 0; i < kTile && first + tile + i < pixels; ++i) {
                float* to = output.floats + (first + tile + i) * size_t(outputs_) + size_t(kBlock * block);
                float values[kBlock];
                float* target = channels == kBlock ? to : values;
                store(target, at_most(at_least(add(rows[i][0], bias_low), lowest), highest));
                store(target + 4, at_most(at_least(add(rows[i][1], bias_high), lowest), highest));
                if (target == values) std::copy_n(values, channels, to);
              }
            }
          }
        });
}

void FloatConvolution::run_like_onnxruntime(const Tensor& input, Tensor& output) const {
  // Images of few channels are summed for each channel first, others for each tap.
  const bool is_by_channel = inputs_ < kBlock;
  const size_t taps = size_t(windows_.taps()), inputs = size_t(inputs_);
  const float* weights = nullptr;
  for (int y = 0; y < output.rows(); ++y) {
    for (int x = 0; x < output.columns(); ++x) {
      float* to = output.floats + (size_t(y) * size_t(output.columns()) + size_t(x)) * size_t(outputs_);
      for (int block = 0; block < blocks_of(outputs_); ++block) {
        Block sums{};
        const auto add_product = [&](size_t tap, size_t channel, Block& sum) {
          weights = weights_.data() + ((size_t(block) * taps + tap) * inputs + channel) * kBlock;
          const double value = double(value_at(input, windows_, x, y, tap)[channel]);
          for (size_t i = 0; i < kBlock; ++i) sum[i] = float(value * double(weights[i]) + double(sum[i]));
        };
        if (is_by_channel) {
          for (size_t channel = 0; channel < inputs; ++channel) {
            Block of_channel{};
            for (size_t tap = 0; tap < taps; ++tap) add_product(tap, channel, of_channel);
            for (size_t i = 0; i < kBlock; ++i) sums[i] = of_channel[i] + sums[i];
          }
        } else {
          for (size_t tap = 0; tap < taps; ++tap) {
            for (size_t channel = 0; channel < inputs; ++channel) add_product(tap, channel, sums);
          }
        }
        const size_t first = size_t(block) * kBlock;
        for (size_t i = 0; i < kBlock && first + i < size_t(outputs_); ++i) {
          to[first + i] = std::clamp(sums[i] + bias_[first + i], range_.lowest, range_.highest);
        }
      }
    }
  }
}

FloatDepthwise::FloatDepthwise(const Windows& windows, int channels, const std::vector<float>& weights,
                               const std::vector<float>& bias)
    : FloatLayer(windows), channels_(channels), bias_(padded(bias, channels)), addresses_(windows, channels) {
  const size_t taps = size_t(windows.taps());
  weights_.resize(taps * size_t(channels));
  for (size_t channel = 0; channel < size_t(channels); ++channel) {
    for (size_t tap = 0; tap < taps; ++tap) {
      weights_[tap * size_t(channels) + channel] = weights[channel * taps + tap];
    }
  }
}

Extents FloatDepthwise::output_extents(const std::vector<const Tensor*>& inputs) const {
  return convolved(windows_, *inputs[0], channels_, channels_);
}

void FloatDepthwise::run(const std::vector<const Tensor*>& inputs, Tensor& output, WorkerThreads& threads) {
  const Tensor& input = *inputs[0];
  const size_t taps = size_t(windows_.taps()), pixels = output.pixels(), products = pixels * taps * size_t(channels_);
  const Floats lowest = repeat(range_.lowest), highest = repeat(range_.highest);
  addresses_.prepare(threads.count());
  share(threads, pixels, kDepthwisePixels, 1, products, [&](size_t first, size_t count, int, int, int thread) {
    const float* const* addresses = addresses_.at(input.floats, input.extents, output.extents, first, count, thread);
    float* to = output.floats + first * size_t(channels_);
    for (size_t pixel = 0; pixel < count; ++pixel, to += channels_) {
      for (int channel = 0; channel < channels_; channel += 4) {
        Floats sum = repeat(0.0f);
        const float* weights = weights_.data() + channel;
        for (size_t tap = 0; tap < taps; ++tap, weights += channels_) {
          sum = add(sum, multiply(load(addresses[tap * count + pixel] + channel), load(weights)));
        }
        store(to + channel, at_most(at_least(add(sum, load(bias_.data() + channel)), lowest), highest));
      }
    }
  });
}

void FloatDepthwise::run_like_onnxruntime(const Tensor& input, Tensor& output) const {
  const size_t channels = size_t(channels_);
  float* to = output.floats;
  for (int y = 0; y < output.rows(); ++y) {
    for (int x = 0; x < output.columns(); ++x, to += channels) {
      std::fill_n(to, channels, 0.0f);
      for (size_t tap = 0; tap < size_t(windows_.taps()); ++tap) {
        const float* from = value_at(input, windows_, x, y, tap);
        const float* weights = weights_.data() + tap * channels;
        for (size_t i = 0; i < channels; ++i) to[i] = float(double(from[i]) * double(weights[i]) + double(to[i]));
      }
      for (size_t i = 0; i < channels; ++i) to[i] = std::clamp(to[i] + bias_[i], range_.lowest, range_.highest);
    }
  }
}

}  // namespace maq
