#include "densepose/surface/chart_predictor.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "core/error.h"
#include "core/simd_clones.h"

namespace maq {
namespace {

constexpr int kKernel = 4;

// Sums in lanes, so that the compiler may make vectors of them without changing the order of additions.
inline float dot(const float* a, const float* b, size_t count) {
  constexpr size_t kLanes = 8;
  float lanes[kLanes] = {};
  size_t i = 0;
  for (; i + kLanes <= count; i += kLanes) {
    for (size_t lane = 0; lane < kLanes; ++lane) lanes[lane] += a[i + lane] * b[i + lane];
  }
  float sum = 0;
  for (; i < count; ++i) sum += a[i] * b[i];
  for (const float lane : lanes) sum += lane;
  return sum;
}

// Applies the kernels [4, 4, channels] of U and V at a cell of the output; features [size, size, channels].
MAQ_SIMD_CLONES ChartPoint transposed_convolution(const float* features, int size, size_t channels,
                                                  const float* kernel_u, const float* kernel_v, int row, int column) {
  ChartPoint sum;
  // An even output row 2y meets input rows y and y - 1 with kernel rows 1 and 3, an odd one y and y + 1 with 2 and 0.
  for (int r = 0; r < 2; ++r) {
    const int kernel_row = row % 2 == 0 ? 1 + 2 * r : 2 - 2 * r;
    const int from_row = row / 2 + (row % 2 == 0 ? -r : r);
    if (from_row < 0 || from_row >= size) continue;
    for (int c = 0; c < 2; ++c) {
      const int kernel_column = column % 2 == 0 ? 1 + 2 * c : 2 - 2 * c;
      const int from_column = column / 2 + (column % 2 == 0 ? -c : c);
      if (from_column < 0 || from_column >= size) continue;
      const float* cell = features + (size_t(from_row) * size_t(size) + size_t(from_column)) * channels;
      const size_t tap = size_t(kernel_row * kKernel + kernel_column) * channels;
      sum.u += dot(cell, kernel_u + tap, channels);
      sum.v += dot(cell, kernel_v + tap, channels);
    }
  }
  return sum;
}

}  // namespace

ChartPredictor::ChartPredictor(const std::vector<uint8_t>& bytes, int parts, const std::string& name) : parts_(parts) {
  const size_t values = bytes.size() / sizeof(float);
  const size_t biases = 2 * size_t(parts);
  const size_t per_channel = biases * kKernel * kKernel;
  if (bytes.size() % sizeof(float) != 0 || values <= biases || (values - biases) % per_channel != 0) {
    throw Error(MAQ_ERROR_BAD_BUNDLE, name, " has ", bytes.size(), " bytes, which are no weights for ", parts,
                " parts. Export the bundle again.");
  }
  channels_ = int((values - biases) / per_channel);
  weight_.resize(values - biases);
  bias_.resize(biases);
  std::memcpy(weight_.data(), bytes.data(), weight_.size() * sizeof(float));
  std::memcpy(bias_.data(), bytes.data() + weight_.size() * sizeof(float), bias_.size() * sizeof(float));
  const auto finite = [](float value) { return std::isfinite(value); };
  if (!std::all_of(weight_.begin(), weight_.end(), finite) || !std::all_of(bias_.begin(), bias_.end(), finite)) {
    throw Error(MAQ_ERROR_BAD_BUNDLE, name, " holds numbers that are not finite. Export the bundle again.");
  }
}

void ChartPredictor::begin(const float* surface, int size) {
  const size_t cells = size_t(size) * size_t(size);
  surface_ = surface;
  const size_t outputs = 4 * cells * size_t(parts_);
  if (size != size_ || ++person_ == 0) {
    known_.resize(outputs);
    known_since_.assign(outputs, 0);
    person_ = 1;
    size_ = size;
  }
}

ChartPoint ChartPredictor::at(int part, int row, int column) {
  const size_t side = 2 * size_t(size_);
  const size_t slot = (size_t(part) * side + size_t(row)) * side + size_t(column);
  ChartPoint& point = known_[slot];
  if (known_since_[slot] == person_) return point;
  known_since_[slot] = person_;
  const size_t u = size_t(part);
  const size_t v = size_t(parts_) + u;
  const size_t kernel = kKernel * kKernel * size_t(channels_);
  point = transposed_convolution(surface_, size_, size_t(channels_), weight_.data() + u * kernel,
                                 weight_.data() + v * kernel, row, column);
  point.u += bias_[u];
  point.v += bias_[v];
  return point;
}

}  // namespace maq
