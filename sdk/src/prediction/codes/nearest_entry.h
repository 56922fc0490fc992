// Which entry of a codebook a vector is nearest to.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "prediction/codes/code_file.h"

namespace maq {

class NearestEntry {
 public:
  explicit NearestEntry(const FrameCodes& codes);

  // `features`: [places][slices * width], of a square of places. `found`: [places][slices], the number of the entry
  // that is nearest to each slice, the lowest of equals; 0 where a feature is not a number.
  void run(const float* features, size_t places, uint16_t* found) const;

 private:
  size_t slices_, width_, blocks_;
  // By blocks of entries: [slices][blocks][width][kLanes], and of each half its squared length, infinite beyond the
  // last entry: [slices][blocks][kLanes].
  std::vector<float> entries_, half_squares_;
};

}  // namespace maq
