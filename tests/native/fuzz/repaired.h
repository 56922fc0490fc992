// Inputs whose start says their true length and checksum: without it nothing behind the checksum is ever read.
#pragma once

#include <cstring>
#include <vector>

#include <xxhash.h>

#include "core/files/checked_bytes.h"

namespace fuzz {

// A copy of exactly that many bytes, so that the address sanitizer sees a read behind it.
inline std::vector<uint8_t> repaired(const uint8_t* data, size_t size) {
  std::vector<uint8_t> bytes(data, data + size);
  maq::FileStart start;
  if (size < sizeof start) return bytes;
  std::memcpy(&start, data, sizeof start);
  start.file_bytes = size;
  std::memcpy(bytes.data(), &start, sizeof start);
  start.check = XXH3_64bits(bytes.data() + maq::kCheckedFrom, size - maq::kCheckedFrom);
  std::memcpy(bytes.data(), &start, sizeof start);
  return bytes;
}

}  // namespace fuzz
