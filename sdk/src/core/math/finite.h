// Whether numbers from outside, such as files, graphs and apps, are ones to calculate with.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace maq {

// Whether none of `count` values is NaN or infinite.
inline bool are_finite(const float* values, size_t count) {
  return std::all_of(values, values + count, [](float value) { return std::isfinite(value); });
}

}  // namespace maq
