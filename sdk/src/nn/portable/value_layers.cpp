#include "nn/portable/value_layers.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "nn/portable/simd.h"

namespace maq {
namespace {

using namespace simd;

// Calls work(place, count) for all values, 8 at a time; the last ones are copied to a place of 8 first.
template <class Work>
void each_eight(size_t count, Work&& work) {
  size_t i = 0;
  for (; i + 8 <= count; i += 8) work(i, size_t(8));
  if (i < count) work(i, count - i);
}

// 8 values, of which `count` are there.
inline Ints load_some(const int16_t* from, size_t count) {
  if (count == 8) return load(from);
  int16_t values[8] = {};
  std::copy_n(from, count, values);
  return load(values);
}

inline void store_some(int16_t* to, Ints values, size_t count) {
  if (count == 8) return store(to, values);
  int16_t stored[8];
  store(stored, values);
  std::copy_n(stored, count, to);
}

struct Floats8 {
  Floats low, high;
};

inline Floats8 load_some(const float* from, size_t count) {
  if (count == 8) return {load(from), load(from + 4)};
  float values[8] = {};
  std::copy_n(from, count, values);
  return {load(values), load(values + 4)};
}

inline void store_some(float* to, const Floats8& values, size_t count) {
  float stored[8];
  float* target = count == 8 ? to : stored;
  store(target, values.low);
  store(target + 4, values.high);
  if (target == stored) std::copy_n(stored, count, to);
}

inline Floats8 floats_of(Ints values) { return {to_floats(widen_low(values)), to_floats(widen_high(values))}; }

// Applies a function of 4 floats to 8.
template <class Work>
inline Floats8 apply(const Floats8& values, Work&& work) {
  return {work(values.low), work(values.high)};
}

template <class Work>
inline Floats8 apply(const Floats8& a, const Floats8& b, Work&& work) {
  return {work(a.low, b.low), work(a.high, b.high)};
}

inline Ints rounded(const Floats8& values, const Quantization& to) {
  const Floats lowest = repeat(to.lowest()), highest = repeat(to.highest());
  const Floats8 limited = apply(values, [&](Floats v) { return at_most(at_least(v, lowest), highest); });
  return narrow(round_to_ints(limited.low), round_to_ints(limited.high));
}

[[noreturn]] void throw_unlike(const char* what, const Extents& a, const Extents& b) {
  throw Error(MAQ_ERROR_INFERENCE, what, " of tensors of unlike sizes: [", a[0], ", ", a[1], ", ", a[2], ", ", a[3],
              "] and [", b[0], ", ", b[1], ", ", b[2], ", ", b[3], "].");
}

}  // namespace

Extents ChannelsLast::output_extents(const std::vector<const Tensor*>& inputs) const {
  const Extents& from = inputs[0]->extents;
  return {from[0], from[2], from[3], from[1]};
}

void ChannelsLast::run(const std::vector<const Tensor*>& inputs, Tensor& output, WorkerThreads&) {
  const size_t channels = size_t(output.channels());
  const size_t pixels = size_t(output.rows()) * size_t(output.columns());
  for (size_t image = 0; image < size_t(output.extents[0]); ++image) {
    const float* from = inputs[0]->floats + image * channels * pixels;
    float* to = output.floats + image * channels * pixels;
    for (size_t pixel = 0; pixel < pixels; ++pixel) {
      for (size_t channel = 0; channel < channels; ++channel) *to++ = from[channel * pixels + pixel];
    }
  }
}

void Quantize::run(const std::vector<const Tensor*>& inputs, Tensor& output, WorkerThreads&) {
  const float* from = inputs[0]->floats;
  const Floats scale = repeat(to_.scale);
  each_eight(count_of(output.extents), [&](size_t at, size_t count) {
    const Floats8 scaled = apply(load_some(from + at, count), [&](Floats v) { return divide(v, scale); });
    store_some(output.quantized + at, rounded(scaled, to_), count);
  });
}

void Dequantize::run(const std::vector<const Tensor*>& inputs, Tensor& output, WorkerThreads&) {
  const int16_t* from = inputs[0]->quantized;
  const Floats scale = repeat(scale_);
  each_eight(count_of(output.extents), [&](size_t at, size_t count) {
    const Floats8 values = floats_of(load_some(from + at, count));
    store_some(output.floats + at, apply(values, [&](Floats v) { return multiply(v, scale); }), count);
  });
}

void Requantize::run(const std::vector<const Tensor*>& inputs, Tensor& output, WorkerThreads&) {
  const int16_t* from = inputs[0]->quantized;
  const Floats scale = repeat(from_.scale / to_.scale);
  each_eight(count_of(output.extents), [&](size_t at, size_t count) {
    const Floats8 values = floats_of(load_some(from + at, count));
    store_some(output.quantized + at, rounded(apply(values, [&](Floats v) { return multiply(v, scale); }), to_), count);
  });
}

Extents QuantizedSum::output_extents(const std::vector<const Tensor*>& inputs) const {
  const Extents &a = inputs[0]->extents, &b = inputs[1]->extents;
  const bool is_repeated = b == Extents{a[0], 1, 1, a[3]};
  if (a != b && !is_repeated) throw_unlike("The sum", a, b);
  return a;
}

void QuantizedSum::run(const std::vector<const Tensor*>& inputs, Tensor& output, WorkerThreads& threads) {
  const Tensor &a = *inputs[0], &b = *inputs[1];
  // ONNX Runtime has all zero points in one term, and rounds once for a product and a sum. Two roundings give another
  // whole number only where the sum is nearly between two, and are done in vectors.
  const float ratio_of_a = a_.scale / to_.scale, ratio_of_b = b_.scale / to_.scale;
  const float fixed = float(to_.zero_point) - (ratio_of_a * float(a_.zero_point) + ratio_of_b * float(b_.zero_point));
  const auto exact = [&](int from_a, int from_b) {
    const float of_b = float(double(from_b + b_.zero_point) * double(ratio_of_b) + double(fixed));
    const float value = float(double(from_a + a_.zero_point) * double(ratio_of_a) + double(of_b));
    return int16_t(int(std::nearbyint(std::clamp(value, 0.0f, 255.0f))) - to_.zero_point);
  };
  const Floats lowest = repeat(to_.lowest()), highest = repeat(to_.highest());
  const auto sum = [&](const int16_t* from_a, const int16_t* from_b, int16_t* to, size_t values) {
    each_eight(values, [&](size_t at, size_t count) {
      const Floats8 sums = apply(
          floats_of(load_some(from_a + at, count)), floats_of(load_some(from_b + at, count)), [&](Floats x, Floats y) {
            const Floats value = add(multiply(x, repeat(ratio_of_a)), multiply(y, repeat(ratio_of_b)));
            return at_most(at_least(value, lowest), highest);
          });
      const Ints low = round_to_ints(sums.low), high = round_to_ints(sums.high);
      store_some(to + at, narrow(low, high), count);
      if (is_nearly_between(sums.low, low) || is_nearly_between(sums.high, high)) {
        for (size_t i = at; i < at + count; ++i) to[i] = exact(from_a[i], from_b[i]);
      }
    });
  };
  const size_t channels = size_t(a.channels()), image = size_t(a.rows()) * size_t(a.columns());
  const bool is_repeated = a.extents != b.extents;
  constexpr size_t kPixels = 512;
  threads.run((a.pixels() + kPixels - 1) / kPixels, [&](size_t task, int) {
    const size_t first = task * kPixels, end = std::min(first + kPixels, a.pixels());
    if (!is_repeated) {
      sum(a.quantized + first * channels, b.quantized + first * channels, output.quantized + first * channels,
          (end - first) * channels);
    }
    for (size_t pixel = first; is_repeated && pixel < end; ++pixel) {
      const size_t at = pixel * channels;
      sum(a.quantized + at, b.quantized + pixel / image * channels, output.quantized + at, channels);
    }
  });
}

Extents FloatSum::output_extents(const std::vector<const Tensor*>& inputs) const {
  if (inputs[0]->extents != inputs[1]->extents) throw_unlike("The sum", inputs[0]->extents, inputs[1]->extents);
  return inputs[0]->extents;
}

void FloatSum::run(const std::vector<const Tensor*>& inputs, Tensor& output, WorkerThreads&) {
  const float *a = inputs[0]->floats, *b = inputs[1]->floats;
  const Floats lowest = repeat(range_.lowest), highest = repeat(range_.highest);
  each_eight(count_of(output.extents), [&](size_t at, size_t count) {
    const Floats8 sums = apply(load_some(a + at, count), load_some(b + at, count),
                               [&](Floats x, Floats y) { return at_most(at_least(add(x, y), lowest), highest); });
    store_some(output.floats + at, sums, count);
  });
}

Extents QuantizedMean::output_extents(const std::vector<const Tensor*>& inputs) const {
  return {inputs[0]->extents[0], 1, 1, inputs[0]->channels()};
}

void QuantizedMean::run(const std::vector<const Tensor*>& inputs, Tensor& output, WorkerThreads&) {
  const Tensor& input = *inputs[0];
  const size_t channels = size_t(input.channels());
  const size_t pixels = size_t(input.rows()) * size_t(input.columns());
  const float scale = from_.scale / (to_.scale * float(pixels));
  std::vector<int32_t> sums(channels);
  for (size_t image = 0; image < size_t(input.extents[0]); ++image) {
    std::fill(sums.begin(), sums.end(), 0);
    const int16_t* from = input.quantized + image * pixels * channels;
    for (size_t pixel = 0; pixel < pixels; ++pixel) {
      for (size_t channel = 0; channel < channels; ++channel) sums[channel] += *from++;
    }
    int16_t* to = output.quantized + image * channels;
    for (size_t channel = 0; channel < channels; ++channel) {
      const Floats mean = repeat(std::clamp(float(sums[channel]) * scale, to_.lowest(), to_.highest()));
      int32_t values[4];
      store(values, round_to_ints(mean));
      to[channel] = int16_t(values[0]);
    }
  }
}

Extents Subsample::output_extents(const std::vector<const Tensor*>& inputs) const {
  const Extents& from = inputs[0]->extents;
  return {from[0], (from[1] - 1) / stride_ + 1, (from[2] - 1) / stride_ + 1, from[3]};
}

void Subsample::run(const std::vector<const Tensor*>& inputs, Tensor& output, WorkerThreads&) {
  const Tensor& input = *inputs[0];
  const size_t channels = size_t(input.channels());
  int16_t* to = output.quantized;
  for (int image = 0; image < output.extents[0]; ++image) {
    for (int row = 0; row < output.rows(); ++row) {
      for (int column = 0; column < output.columns(); ++column, to += channels) {
        const size_t line = size_t(image) * size_t(input.rows()) + size_t(row * stride_);
        std::copy_n(input.quantized + (line * size_t(input.columns()) + size_t(column * stride_)) * channels, channels,
                    to);
      }
    }
  }
}

Extents Concatenation::output_extents(const std::vector<const Tensor*>& inputs) const {
  Extents extents = inputs[0]->extents;
  extents[axis_] = 0;
  for (const Tensor* input : inputs) {
    Extents others = input->extents;
    others[axis_] = extents[axis_];
    if (others != extents) throw_unlike("The concatenation", inputs[0]->extents, input->extents);
    extents[axis_] += input->extents[axis_];
  }
  return extents;
}

void Concatenation::run(const std::vector<const Tensor*>& inputs, Tensor& output, WorkerThreads&) {
  size_t outer = 1, whole = 1;  // runs, and values of a run
  for (size_t axis = 0; axis < 4; ++axis) (axis < axis_ ? outer : whole) *= size_t(output.extents[axis]);
  size_t begin = 0;
  for (const Tensor* input : inputs) {
    const size_t part = count_of(input->extents) / outer;
    for (size_t i = 0; i < outer; ++i) {
      if (output.quantized != nullptr) {
        std::copy_n(input->quantized + i * part, part, output.quantized + i * whole + begin);
      } else {
        std::copy_n(input->floats + i * part, part, output.floats + i * whole + begin);
      }
    }
    begin += part;
  }
}

Extents Reshape::output_extents(const std::vector<const Tensor*>& inputs) const {
  const Extents& from = inputs[0]->extents;
  Extents to{1, 1, 1, 1};
  if (extents_.empty()) {
    to = inputs[1]->extents;
  } else {
    int rest = -1, known = 1;
    for (size_t axis = 0; axis < std::min(extents_.size(), to.size()); ++axis) {
      to[axis] = extents_[axis] == 0 ? from[axis] : int(extents_[axis]);
      if (to[axis] < 0) rest = int(axis);
      if (to[axis] > 0) known *= to[axis];
    }
    if (rest >= 0) to[size_t(rest)] = int(count_of(from)) / known;
  }
  if (count_of(from) != count_of(to)) throw_unlike("The new shape", from, to);
  return to;
}

void Reshape::run(const std::vector<const Tensor*>& inputs, Tensor& output, WorkerThreads&) {
  if (output.quantized != nullptr) {
    std::copy_n(inputs[0]->quantized, count_of(output.extents), output.quantized);
  } else {
    std::copy_n(inputs[0]->floats, count_of(output.extents), output.floats);
  }
}

}  // namespace maq
