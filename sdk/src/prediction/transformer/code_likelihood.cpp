#include "prediction/transformer/code_likelihood.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/simd_clones.h"
#include "prediction/codec/code_file.h"

namespace maq {
namespace {

constexpr size_t kAtOnce = 16;
constexpr float kInfiniteLogit = std::numeric_limits<float>::infinity(), kLog2E = 1.44269504f;

MAQ_SIMD_CLONES void add_scaled(const uint8_t* bits, size_t entries, float scale, float* logits) {
  for (size_t i = 0; i < entries; ++i) logits[i] += scale * float(bits[i]);
}

// The largest; NaN where one is.
MAQ_SIMD_CLONES float largest_of(const float* logits, size_t entries) {
  float largest[kAtOnce];
  int32_t is_nan[kAtOnce] = {};
  std::fill_n(largest, kAtOnce, -kInfiniteLogit);
  const size_t whole = entries - entries % kAtOnce;
  for (size_t i = 0; i < whole; i += kAtOnce) {
    for (size_t lane = 0; lane < kAtOnce; ++lane) {
      const float value = logits[i + lane];
      largest[lane] = value > largest[lane] ? value : largest[lane];
      is_nan[lane] |= value != value ? 1 : 0;
    }
  }
  for (size_t i = whole; i < entries; ++i) {
    largest[0] = std::max(largest[0], logits[i]);
    is_nan[0] |= std::isnan(logits[i]) ? 1 : 0;
  }
  float found = -kInfiniteLogit;
  for (size_t lane = 0; lane < kAtOnce; ++lane) {
    if (is_nan[lane] != 0) return std::numeric_limits<float>::quiet_NaN();
    found = std::max(found, largest[lane]);
  }
  return found;
}

// Two loops: in one, the compiler would branch at the limit, and make no vectors.
MAQ_SIMD_CLONES void weigh(const float* logits, size_t entries, float largest, float temperature, float* weights) {
  for (size_t i = 0; i < entries; ++i) {
    const float below = (logits[i] - largest) / temperature;
    weights[i] = below > -87.0f ? below : -87.0f;
  }
  for (size_t i = 0; i < entries; ++i) weights[i] = exp_of_negative(weights[i]);
}

MAQ_SIMD_CLONES float sum_of(const float* values, size_t count) {
  float sums[kAtOnce] = {};
  const size_t whole = count - count % kAtOnce;
  for (size_t i = 0; i < whole; i += kAtOnce) {
    for (size_t lane = 0; lane < kAtOnce; ++lane) sums[lane] += values[i + lane];
  }
  float sum = 0;
  for (size_t i = whole; i < count; ++i) sum += values[i];
  for (const float own : sums) sum += own;
  return sum;
}

}  // namespace

void add_stored_prior(const uint8_t* bits, size_t entries, float* logits) {
  add_scaled(bits, entries, -0.69314718f / FrameCodes::kBitSteps, logits);
}

float largest_logit(const float* logits, size_t entries) { return largest_of(logits, entries); }

void likelihood_weights(const float* logits, size_t entries, float largest, float temperature, float* weights) {
  weigh(logits, entries, largest, temperature, weights);
}

float bits_of_code(const float* logits, size_t entries, size_t code) {
  const float largest = largest_of(logits, entries);
  if (std::isnan(largest)) return largest;
  if (std::isinf(largest)) {
    if (logits[code] != largest) return kMaxCodeBits;
    return std::log2(float(std::count(logits, logits + entries, largest)));
  }
  std::array<float, kMaxCodeEntries> weights;
  weigh(logits, entries, largest, 1, weights.data());
  const float bits = std::log2(sum_of(weights.data(), entries)) - (logits[code] - largest) * kLog2E;
  return std::clamp(bits, 0.0f, kMaxCodeBits);
}

float entropy_bits(const float* logits, size_t entries) {
  const float largest = largest_of(logits, entries);
  if (std::isnan(largest)) return largest;
  if (std::isinf(largest)) return std::log2(float(std::count(logits, logits + entries, largest)));
  std::array<float, kMaxCodeEntries> weights;
  weigh(logits, entries, largest, 1, weights.data());
  const float sum = sum_of(weights.data(), entries);
  for (size_t i = 0; i < entries; ++i) weights[i] *= std::min(largest - logits[i], 87.0f);
  return std::log2(sum) + sum_of(weights.data(), entries) / sum * kLog2E;
}

}  // namespace maq
