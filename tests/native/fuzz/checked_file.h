// Inputs whose start says their true length and checksum: otherwise nothing behind the checksum is ever read.
#pragma once

#include <xxhash.h>

#include "core/files/checked_bytes.h"
#include "fuzz_target.h"

namespace fuzz {

inline Bytes repaired(Bytes bytes) {
  maq::FileStart start;
  if (bytes.size() < sizeof start) return bytes;
  std::memcpy(&start, bytes.data(), sizeof start);
  start.file_bytes = bytes.size();
  std::memcpy(bytes.data(), &start, sizeof start);
  start.check = XXH3_64bits(bytes.data() + maq::kCheckedFrom, bytes.size() - maq::kCheckedFrom);
  std::memcpy(bytes.data(), &start, sizeof start);
  return bytes;
}

}  // namespace fuzz
