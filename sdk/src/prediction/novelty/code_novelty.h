// The surprisal of the codes of a frame, given the frame before: -log2 of the probability of each.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "prediction/codec/code_file.h"

namespace maq {

// For one stream. Each code stays or changes; a change has the probability of the transformer or of the bigram prior.
// Each cell learns from the stream how likely staying is: a mixture of two experts, weighted by their posterior. A part
// of the weight returns to both, so that each can recover (Herbster and Warmuth, "Tracking the best expert", 1998).
class CodeNovelty {
 public:
  explicit CodeNovelty(const FrameCodes& codes);

  // Forgets the stream: the next frame is scored by the unigram prior.
  void reset() { has_frame_ = false; }

  // Scores the next frame: `codes` [cells][groups] -> `bits` [cells], the mean bits of a code. `predicted_bits`: bits
  // of each code by the transformer, [cells][groups], or null for the bigram prior; not used for a first frame. Returns
  // true for a cut, where the frame before makes the codes no more likely; the weights are then reset.
  bool add(const uint16_t* codes, const float* predicted_bits, float* bits);

 private:
  const FrameCodes& codes_;
  std::array<float, 256> probability_;  // of stored bits
  std::vector<uint16_t> before_;        // [cells][groups]
  std::vector<float> stays_;            // [cells][groups]: weight of the expert that the code stays
  bool has_frame_ = false;
};

}  // namespace maq
