// The code file of a bundle (.maqc, docs/reference/formats.md): the codebook and the probabilities of its codes.
// Written by export/prediction/code_file.py.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace maq {

inline constexpr size_t kMaxCodeGroups = 16, kMaxCodeEntries = 1024, kMaxCodeWidth = 256, kMaxCodeSide = 64;

// A frame has side * side cells, row by row. Each cell has one code for each codebook group: the index of the nearest
// entry.
struct FrameCodes {
  static constexpr int kBitSteps = 16;  // steps of a bit (-log2 of a probability); 255: that or more

  size_t groups = 0, entries = 0, width = 0, side = 0;
  std::vector<float> vectors;         // [groups][entries][width]
  std::vector<uint8_t> unigram_bits;  // [groups][entries]: unigram prior
  std::vector<uint8_t> bigram_bits;   // [groups][before][code]: bigram prior of a cell

  size_t cells() const { return side * side; }
  size_t count() const { return cells() * groups; }  // codes of a frame
};

// Reads hostile bytes safely: sizes are within the limits above, and vectors are finite. `bytes` may be null when
// `count` is 0. `name` begins the error sentence. Throws MAQ_ERROR_BAD_BUNDLE for a truncated, damaged or other file,
// and MAQ_ERROR_UNSUPPORTED for another version.
FrameCodes read_code_file(const void* bytes, size_t count, const std::string& name);

}  // namespace maq
