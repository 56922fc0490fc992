// Finds the nearest codebook entries of feature vectors.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "prediction/codec/code_file.h"

namespace maq {

class NearestEntry {
 public:
  explicit NearestEntry(const FrameCodes& codes);

  // `features`: [cells][groups * width] of a square of cells. Writes the index of the nearest entry of each group to
  // `found`, [cells][groups]: the lowest of equals, and 0 for a feature that is not a number.
  void run(const float* features, size_t cells, uint16_t* found) const;

 private:
  size_t groups_, width_, blocks_;
  // In blocks of kLanes entries: [groups][blocks][width][kLanes], and half the squared length of each,
  // [groups][blocks][kLanes], infinite after the last entry.
  std::vector<float> entries_, half_squares_;
};

}  // namespace maq
