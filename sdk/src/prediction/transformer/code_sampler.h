// Draws codes by their logits. Equal logits give equal codes on every processor: no function of the system is called,
// nothing is fused, and weights are added as whole numbers.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace maq {

struct SamplingSettings {
  float temperature = 1;  // 0: the likeliest, the lowest of equals; infinite: each as likely as the others
  size_t top_k = 0;       // only so many of the likeliest, the lowest of equals first; 0: all
  uint64_t seed = 0;
};

// What a code is drawn for: each has a random number of its own.
struct DrawPosition {
  uint32_t stream = 0, frame = 0;
  uint16_t sample = 0, slice = 0;
  uint32_t place = 0;
};

// Not for two threads at once.
class CodeSampler {
 public:
  // Throws MAQ_ERROR_INVALID_ARGUMENT for a temperature that is negative or NaN, and where top_k is more than
  // `entries`, at most kMaxCodeEntries.
  CodeSampler(const SamplingSettings& settings, size_t entries);

  // Of infinite logits each is as likely as the others. Throws MAQ_ERROR_INFERENCE where one is NaN.
  uint16_t draw(const float* logits, const DrawPosition& position);

 private:
  const SamplingSettings settings_;
  std::vector<float> weights_, sorted_;
};

}  // namespace maq
