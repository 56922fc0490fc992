// Parts of names of temporary files.
#pragma once

#include <cstdio>
#include <random>
#include <string>

namespace maq {

// 16 hexadecimal digits, unpredictable: no other program can put something in the place of the file beforehand.
inline std::string random_digits() {
  std::random_device random;
  char digits[17];
  std::snprintf(digits, sizeof digits, "%08x%08x", random(), random());
  return digits;
}

}  // namespace maq
