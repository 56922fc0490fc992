// Division and rounding of whole numbers that are not negative.
#pragma once

namespace maq {

template <class Integer>
constexpr Integer divide_up(Integer value, Integer divisor) {
  return (value + divisor - 1) / divisor;
}

// To the next multiple of `multiple`.
template <class Integer>
constexpr Integer round_up(Integer value, Integer multiple) {
  return divide_up(value, multiple) * multiple;
}

}  // namespace maq
