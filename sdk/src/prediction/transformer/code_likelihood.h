// What logits say of codes.
#pragma once

#include <cstddef>
#include <cstdint>

namespace maq {

inline constexpr float kMaxCodeBits = 24;  // no code counts as less likely than 2^-24

// Adds logarithms of probabilities that are stored as bits in steps of 1/16 (FrameCodes).
void add_stored_prior(const uint8_t* bits, size_t entries, float* logits);

// -log2 of the softmax of one of `entries` codes (at most kMaxCodeEntries), at most kMaxCodeBits. Infinite ones share
// all where there are some; where all are -infinity they are equal. NaN where a logit is NaN.
float bits_of_code(const float* logits, size_t entries, size_t code);

// The mean of that by these probabilities: how uncertain the code is, 0 to log2(entries). NaN where a logit is NaN.
float entropy_bits(const float* logits, size_t entries);

// NaN where one of them is.
float largest_logit(const float* logits, size_t entries);

// exp((logit - largest) / temperature) of each, at least exp(-87), the same on every processor. Neither of the numbers
// is infinite.
void likelihood_weights(const float* logits, size_t entries, float largest, float temperature, float* weights);

}  // namespace maq
