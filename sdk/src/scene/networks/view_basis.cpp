#include "scene/networks/view_basis.h"

#include <algorithm>

#include "core/simd_clones.h"

namespace maq {
namespace {

// As many directions as are worked on at once: all layers of them stay in the first cache.
constexpr size_t kDirectionBlock = 64;
constexpr float kSlope = 0.01f;

// Sine and cosine of pi/2 times `x`, which is within [-1, 1]: Taylor series of the angle, to the last bit of a float.
inline void sine_and_cosine(float x, float& sine, float& cosine) {
  const float a = 1.57079632679f * x, b = a * a;
  sine = a * (1 - b / 6 * (1 - b / 20 * (1 - b / 42 * (1 - b / 72 * (1 - b / 110 * (1 - b / 156))))));
  cosine = 1 - b / 2 * (1 - b / 12 * (1 - b / 30 * (1 - b / 56 * (1 - b / 90 * (1 - b / 132)))));
}

// A block of one layer: `in` [inputs][kDirectionBlock] to `out` [outputs][kDirectionBlock]. Returns the address after
// the layer's weights.
template <int inputs, int outputs, bool is_activated>
inline const float* layer(const float* weights, const float* in, float* out) {
  const float* bias = weights + inputs * outputs;
  for (int o = 0; o < outputs; ++o) {
    float* to = out + size_t(o) * kDirectionBlock;
    for (size_t i = 0; i < kDirectionBlock; ++i) to[i] = bias[o];
    for (int k = 0; k < inputs; ++k) {
      const float weight = weights[o * inputs + k];
      const float* from = in + size_t(k) * kDirectionBlock;
      for (size_t i = 0; i < kDirectionBlock; ++i) to[i] += weight * from[i];
    }
    if (is_activated) {
      for (size_t i = 0; i < kDirectionBlock; ++i) to[i] = std::max(to[i], kSlope * to[i]);
    }
  }
  return bias + outputs;
}

MAQ_SIMD_CLONES void evaluate_block(const float* weights, const float* const directions[3], float* values) {
  float encoded[ViewBasis::kEncoded * kDirectionBlock], first[ViewBasis::kHidden * kDirectionBlock],
      second[ViewBasis::kHidden * kDirectionBlock];
  for (int axis = 0; axis < 3; ++axis) {
    for (size_t i = 0; i < kDirectionBlock; ++i) {
      float sine, cosine;
      sine_and_cosine(directions[axis][i], sine, cosine);
      // Sine and cosine of twice the angle, then of four times the angle.
      for (int frequency = 0; frequency < 3; ++frequency) {
        encoded[size_t(6 * frequency + axis) * kDirectionBlock + i] = sine;
        encoded[size_t(6 * frequency + 3 + axis) * kDirectionBlock + i] = cosine;
        const float twice = 2 * sine * cosine;
        cosine = 1 - 2 * sine * sine;
        sine = twice;
      }
    }
  }
  weights = layer<ViewBasis::kEncoded, ViewBasis::kHidden, true>(weights, encoded, first);
  weights = layer<ViewBasis::kHidden, ViewBasis::kHidden, true>(weights, first, second);
  layer<ViewBasis::kHidden, kBasis, false>(weights, second, values);
}

}  // namespace

void ViewBasis::evaluate(const float* x, const float* y, const float* z, size_t count, float* values) const {
  const float* const coordinates[3] = {x, y, z};
  for (size_t begin = 0; begin < count; begin += kDirectionBlock) {
    const size_t size = std::min(kDirectionBlock, count - begin);
    float padded[3][kDirectionBlock] = {}, block[kBasis * kDirectionBlock];
    for (int axis = 0; axis < 3; ++axis) std::copy_n(coordinates[axis] + begin, size, padded[axis]);
    const float* const directions[3] = {padded[0], padded[1], padded[2]};
    evaluate_block(weights_.data(), directions, block);
    for (int k = 0; k < kBasis; ++k)
      std::copy_n(block + size_t(k) * kDirectionBlock, size, values + size_t(k) * count + begin);
  }
}

}  // namespace maq
