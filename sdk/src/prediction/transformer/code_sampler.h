// Samples codes from logits. Equal logits give equal codes on every processor: no system function is called, nothing is
// fused, and weights are added as integers.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace maq {

struct SamplingSettings {
  float temperature = 1;  // 0: the likeliest code, the lowest of equals; infinite: uniform
  uint64_t seed = 0;
};

// The position of a code; each position has its own random number.
struct SamplePosition {
  uint32_t stream = 0, frame = 0;
  uint16_t sample = 0, group = 0;
  uint32_t cell = 0;
};

// Not for two threads at once.
class CodeSampler {
 public:
  // `entries`: at most kMaxCodeEntries. Throws MAQ_ERROR_INVALID_ARGUMENT for a temperature that is negative or NaN.
  CodeSampler(const SamplingSettings& settings, size_t entries);

  // Infinite logits are equally likely. Throws MAQ_ERROR_INFERENCE if a logit is NaN.
  uint16_t sample(const float* logits, const SamplePosition& position);

 private:
  const SamplingSettings settings_;
  std::vector<float> weights_;
};

}  // namespace maq
