#include "prediction/transformer/code_likelihood.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/simd_clones.h"
#include "prediction/codes/code_file.h"

namespace maq {
namespace {

constexpr size_t kLanes = 16;
constexpr float kInfinity = std::numeric_limits<float>::infinity(), kLog2E = 1.44269504f;

MAQ_SIMD_CLONES void add_scaled(const uint8_t* bits, size_t entries, float scale, float* logits) {
  for (size_t i = 0; i < entries; ++i) logits[i] += scale * float(bits[i]);
}

// The largest; NaN where one is.
MAQ_SIMD_CLONES float largest_of(const float* logits, size_t entries) {
  float largest[kLanes];
  int32_t is_nan[kLanes] = {};
  std::fill_n(largest, kLanes, -kInfinity);
  const size_t whole = entries - entries % kLanes;
  for (size_t i = 0; i < whole; i += kLanes) {
    for (size_t lane = 0; lane < kLanes; ++lane) {
      const float value = logits[i + lane];
      largest[lane] = value > largest[lane] ? value : largest[lane];
      is_nan[lane] |= value != value ? 1 : 0;
    }
  }
  for (size_t i = whole; i < entries; ++i) {
    largest[0] = std::max(largest[0], logits[i]);
    is_nan[0] |= std::isnan(logits[i]) ? 1 : 0;
  }
  float found = -kInfinity;
  for (size_t lane = 0; lane < kLanes; ++lane) {
    if (is_nan[lane] != 0) return std::numeric_limits<float>::quiet_NaN();
    found = std::max(found, largest[lane]);
  }
  return found;
}

float weight(float logit, float largest) { return exp_of_negative(std::max(logit - largest, -87.0f)); }

MAQ_SIMD_CLONES float sum_of_weights(const float* logits, size_t entries, float largest) {
  float sums[kLanes] = {};
  const size_t whole = entries - entries % kLanes;
  for (size_t i = 0; i < whole; i += kLanes) {
    for (size_t lane = 0; lane < kLanes; ++lane) {
      const float below = logits[i + lane] - largest;
      sums[lane] += exp_of_negative(below > -87.0f ? below : -87.0f);
    }
  }
  for (size_t i = whole; i < entries; ++i) sums[0] += weight(logits[i], largest);
  float sum = 0;
  for (const float own : sums) sum += own;
  return sum;
}

}  // namespace

void add_stored_prior(const uint8_t* bits, size_t entries, float* logits) {
  add_scaled(bits, entries, -0.69314718f / FrameCodes::kBitSteps, logits);
}

float bits_of_code(const float* logits, size_t entries, size_t code) {
  const float largest = largest_of(logits, entries);
  if (std::isnan(largest)) return largest;
  if (std::isinf(largest)) {
    if (logits[code] != largest) return kMaxCodeBits;
    return std::log2(float(std::count(logits, logits + entries, largest)));
  }
  const float bits = std::log2(sum_of_weights(logits, entries, largest)) - (logits[code] - largest) * kLog2E;
  return std::clamp(bits, 0.0f, kMaxCodeBits);
}

}  // namespace maq
