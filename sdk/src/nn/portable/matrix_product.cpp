#include "nn/portable/matrix_product.h"

#include <algorithm>
#include <array>

#include "core/error.h"

namespace maq {
namespace {

constexpr size_t kWidth = 8;     // outputs of a step
constexpr size_t kSummed = 256;  // inputs whose products are summed before the sum is added to the result

}  // namespace

MatrixProduct::MatrixProduct(size_t inputs, size_t outputs, const std::vector<float>& weights,
                             const std::vector<float>& bias)
    : inputs_(inputs), outputs_(outputs) {
  const size_t blocks = (outputs + kWidth - 1) / kWidth;
  weights_.resize(blocks * kWidth * inputs);
  for (size_t output = 0; output < outputs; ++output) {
    for (size_t input = 0; input < inputs; ++input) {
      weights_[(output / kWidth * inputs + input) * kWidth + output % kWidth] = weights[output * inputs + input];
    }
  }
  set_bias(bias);
}

void MatrixProduct::set_bias(const std::vector<float>& bias) {
  bias_ = bias;
  bias_.resize((outputs_ + kWidth - 1) / kWidth * kWidth);
}

Extents MatrixProduct::output_extents(const std::vector<const Tensor*>& inputs) const {
  Extents extents = inputs[0]->extents;
  if (size_t(extents[3]) != inputs_) {
    throw Error(MAQ_ERROR_INFERENCE, "A product of ", inputs_, " channels got ", extents[3], ".");
  }
  extents[3] = int(outputs_);
  return extents;
}

void MatrixProduct::run(const std::vector<const Tensor*>& inputs, Tensor& output, WorkerThreads& threads) {
  const size_t blocks = (outputs_ + kWidth - 1) / kWidth, pixels = output.pixels();
  // A task has some 16,384 products, or those of one pixel and 8 outputs if these are more.
  const size_t part = std::max<size_t>(1, 16384 / std::max<size_t>(1, inputs_ * kWidth));
  threads.run((pixels + part - 1) / part * blocks, [&](size_t task, int) {
    const size_t first = task % blocks * kWidth, begin = task / blocks * part;
    for (size_t pixel = begin; pixel < std::min(begin + part, pixels); ++pixel) {
      multiply(inputs[0]->floats + pixel * inputs_, first, output.floats + pixel * outputs_ + first);
    }
  });
}

void MatrixProduct::multiply(const float* from, size_t first, float* to) const {
  std::array<float, kWidth> result;
  std::copy_n(bias_.data() + first, kWidth, result.begin());
  const float* weights = weights_.data() + first * inputs_;
  for (size_t begin = 0; begin < inputs_; begin += kSummed) {
    std::array<float, kWidth> sums{};
    for (size_t input = begin; input < std::min(begin + kSummed, inputs_); ++input, weights += kWidth) {
      const double value = double(from[input]);
      for (size_t i = 0; i < kWidth; ++i) sums[i] = float(value * double(weights[i]) + double(sums[i]));
    }
    for (size_t i = 0; i < kWidth; ++i) result[i] = sums[i] + result[i];
  }
  std::copy_n(result.begin(), std::min(kWidth, outputs_ - first), to);
}

}  // namespace maq
