// Codes of frames in a file of a bundle (.maqc, docs/formats.md): what they stand for, and how likely each is. Written
// by export/prediction/code_file.py.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace maq {

inline constexpr size_t kMaxCodeSlices = 16, kMaxCodeEntries = 1024, kMaxCodeWidth = 256, kMaxCodeSide = 64;

// A frame has side * side places, row by row, with a code for each slice of its features: the number of the entry that
// is nearest to that slice.
struct FrameCodes {
  static constexpr int kBitSteps = 16;  // in which bits, -log2 of a probability, are counted; 255: that much or more

  size_t slices = 0, entries = 0, width = 0, side = 0;
  std::vector<float> vectors;           // [slices][entries][width]
  std::vector<uint8_t> frequency_bits;  // [slices][entries]: of a code by itself
  std::vector<uint8_t> after_bits;      // [slices][entries][entries]: of a code (last axis) after another at its place

  size_t places() const { return side * side; }
  size_t count() const { return places() * slices; }  // codes of a frame
};

// `bytes` may be null where `count` is 0, and are not needed afterwards. `name` begins the sentence of errors. Whatever
// the bytes: sizes are within the limits above, and vectors are finite. Throws MAQ_ERROR_BAD_BUNDLE for what is not a
// file of codes, truncated or damaged; MAQ_ERROR_UNSUPPORTED for another version.
FrameCodes read_code_file(const void* bytes, size_t count, const std::string& name);

}  // namespace maq
