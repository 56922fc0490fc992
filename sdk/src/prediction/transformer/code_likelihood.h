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

}  // namespace maq
