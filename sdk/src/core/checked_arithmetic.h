// Sums and products of sizes that come from outside: strides, counts, offsets. They report an overflow and
// never wrap.
#pragma once

#include <optional>

namespace maq {

// Nothing where the sum does not fit into T.
template <class T>
std::optional<T> checked_sum(T a, T b) {
  T sum;
  if (__builtin_add_overflow(a, b, &sum)) return {};
  return sum;
}

// Nothing where the product does not fit into T.
template <class T>
std::optional<T> checked_product(T a, T b) {
  T product;
  if (__builtin_mul_overflow(a, b, &product)) return {};
  return product;
}

}  // namespace maq
