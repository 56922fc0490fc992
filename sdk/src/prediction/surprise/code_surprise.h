// How unexpected the codes of a frame are, given those of the frame before: -log2 of the probability of each.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "prediction/codes/code_file.h"

namespace maq {

// Of a stream. Each code either stays as it is or follows what was foreseen, by the table of what follows which code
// where nothing else did; how likely staying is,
// each place learns from the stream: a mixture of two experts whose weight is their posterior, of which a part returns
// to both, so that each may come back (Herbster and Warmuth, "Tracking the best expert", 1998).
class CodeSurprise {
 public:
  explicit CodeSurprise(const FrameCodes& codes);

  // Forgets the frames so far: the next one has the bits of codes by themselves.
  void reset() { has_frame_ = false; }

  // `codes` of the next frame, [places][slices] -> bits [places]: a code's, the mean of its place. `foreseen`: bits of
  // each code by something that knows better than the table, [places][slices], or null; not of a first frame. Where
  // codes follow from the frame before no better than any others would, as after a cut, what was learnt is forgotten,
  // and this is true.
  bool add(const uint16_t* codes, const float* foreseen, float* bits);

 private:
  const FrameCodes& codes_;
  std::array<float, 256> probability_;  // by stored bits
  std::vector<uint16_t> before_;        // [places][slices]
  std::vector<float> stays_;            // [places][slices]: the weight of staying
  bool has_frame_ = false;
};

}  // namespace maq
