// Probabilities of codes from logits.
#pragma once

#include <cstddef>
#include <cstdint>

namespace maq {

inline constexpr float kMaxCodeBits = 24;  // the least probability of a code is 2^-24

// Adds logarithms of probabilities that are stored as bits in steps of 1/16 (FrameCodes).
void add_stored_prior(const uint8_t* bits, size_t entries, float* logits);

// Returns -log2 of the softmax of one of `entries` codes (at most kMaxCodeEntries), at most kMaxCodeBits. Logits of
// +infinity share the whole probability; if all are -infinity, all codes are equal. NaN if a logit is NaN.
float bits_of_code(const float* logits, size_t entries, size_t code);

// Returns the entropy of the code, 0 to log2(entries) bits. NaN if a logit is NaN.
float entropy_bits(const float* logits, size_t entries);

// Returns NaN if a logit is NaN.
float largest_logit(const float* logits, size_t entries);

// Writes exp((logit - largest) / temperature), at least exp(-87), identical on every processor. `largest` and
// `temperature` are finite.
void likelihood_weights(const float* logits, size_t entries, float largest, float temperature, float* weights);

}  // namespace maq
