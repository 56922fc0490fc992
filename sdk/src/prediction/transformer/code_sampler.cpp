#include "prediction/transformer/code_sampler.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/error.h"
#include "prediction/transformer/code_likelihood.h"
#include "prediction/transformer/philox.h"

namespace maq {
namespace {

constexpr float kUnbounded = std::numeric_limits<float>::infinity();
constexpr float kUnit = 1 << 30;  // the weight of the likeliest

}  // namespace

CodeSampler::CodeSampler(const SamplingSettings& settings, size_t entries) : settings_(settings), weights_(entries) {
  if (!(settings.temperature >= 0)) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "The temperature is ", settings.temperature, ", but must be 0 or more.");
  }
}

uint16_t CodeSampler::sample(const float* logits, const SamplePosition& position) {
  const size_t entries = weights_.size();
  const float largest = largest_logit(logits, entries), temperature = settings_.temperature;
  if (std::isnan(largest)) {
    throw Error(MAQ_ERROR_INFERENCE, "The transformer returned NaN. Install the bundle again.");
  }
  const auto likeliest = uint16_t(std::find(logits, logits + entries, largest) - logits);  // the first of equals
  if (temperature == 0) return likeliest;

  if (std::isinf(largest)) {  // uniform over the +infinite ones, or over all if all are -infinite
    std::transform(logits, logits + entries, weights_.begin(), [&](float l) { return l == largest ? kUnit : 0.0f; });
  } else if (std::isinf(temperature)) {
    std::transform(logits, logits + entries, weights_.begin(), [](float l) { return l > -kUnbounded ? kUnit : 0.0f; });
  } else {
    likelihood_weights(logits, entries, largest, temperature, weights_.data());
    for (float& weight : weights_) weight *= kUnit;
  }
  uint64_t total = 0;
  for (const float weight : weights_) total += uint32_t(int32_t(weight));
  const std::array<uint32_t, 4> words =
      philox({position.cell, position.frame, position.stream, uint32_t(position.sample) << 16 | position.group},
             settings_.seed);
  // 53 of the bits, as many as a double has, below 1; the product is rounded once, whatever the processor.
  const uint64_t random = (uint64_t(words[0]) << 32 | words[1]) >> 11;
  uint64_t left = std::min(uint64_t(double(random) * 0x1p-53 * double(total)), total - 1);
  for (size_t i = 0; i < entries; ++i) {
    const auto weight = uint32_t(int32_t(weights_[i]));
    if (left < weight) return uint16_t(i);
    left -= weight;
  }
  return likeliest;  // not reached: the weights add up to the total
}

}  // namespace maq
