// Damage to files that begin with a checksum: their start, and checks that fit.
#pragma once

#include <gtest/gtest.h>

#include <cstring>
#include <functional>
#include <random>
#include <string>

#define XXH_INLINE_ALL
#include <xxhash.h>

#include "core/error.h"
#include "core/files/checked_bytes.h"

namespace checked_file_damage {

// Makes the check right, and the length where `with_length`.
inline void repair(std::string& bytes, bool with_length = false) {
  maq::FileStart start;
  if (bytes.size() < sizeof start) return;
  std::memcpy(&start, bytes.data(), sizeof start);
  if (with_length) start.file_bytes = bytes.size();
  std::memcpy(bytes.data(), &start, sizeof start);
  start.check = XXH3_64bits(bytes.data() + maq::kCheckedFrom, bytes.size() - maq::kCheckedFrom);
  std::memcpy(bytes.data(), &start, sizeof start);
}

// Opens and uses bytes, from memory of exactly their length, so that the address sanitizer sees a read behind it.
using Use = std::function<void(const void* bytes, size_t count)>;

inline bool is_refused(const std::string& bytes, maq_status status, const Use& use) {
  const std::vector<char> copy(bytes.begin(), bytes.end());
  try {
    use(copy.data(), copy.size());
  } catch (const maq::Error& error) {
    EXPECT_TRUE(error.status() == status || error.status() == MAQ_ERROR_UNSUPPORTED) << error.what();
    EXPECT_EQ(std::string(error.what()).back(), '.') << error.what();
    return true;
  }
  return false;
}

// Cut at each byte, longer by one, and with each bit changed: all of them refused, with `status` or as unsupported.
inline void expect_all_damage_noticed(std::string bytes, maq_status status, const Use& use) {
  ASSERT_FALSE(is_refused(bytes, status, use));
  for (size_t left = bytes.size(); left-- > 0;) {
    ASSERT_TRUE(is_refused(bytes.substr(0, left), status, use)) << left << " of " << bytes.size();
  }
  ASSERT_TRUE(is_refused(bytes + '\0', status, use));
  for (size_t at = 0; at < bytes.size(); ++at) {
    for (int bit = 0; bit < 8; ++bit) {
      bytes[at] = char(bytes[at] ^ (1 << bit));
      ASSERT_TRUE(is_refused(bytes, status, use)) << "bit " << bit << " of byte " << at;
      bytes[at] = char(bytes[at] ^ (1 << bit));
    }
  }
}

// Whatever is written into the file, whose check is then made right: refused, or harmless to use. Half of the changes
// are in the first `head_bytes`.
inline void expect_random_changes_harmless(const std::string& whole, size_t head_bytes, int rounds, maq_status status,
                                           const Use& use) {
  std::mt19937 random(11);
  const uint32_t nasty[] = {0,      1,      2,          3,          7,          8,          0x7f,       0xff,
                            512,    513,    65535,      0x7fffffff, 0x80000000, 0xffffffff, 0x7f800000, 0xff800000,
                            0x7c00, 0xfc00, 0x7fc00000, 0x7f7fffff, 0x00000001, 0x7149f2ca};
  int refused = 0, opened = 0;
  for (int round = 0; round < rounds; ++round) {
    std::string bytes = whole;
    for (uint32_t change = 0; change <= random() % 3; ++change) {
      const size_t span = random() % 2 == 0 ? head_bytes : bytes.size();
      const size_t at = random() % (span / 4) * 4;
      const uint32_t value = random() % 2 == 0 ? uint32_t(random()) : nasty[random() % std::size(nasty)];
      std::memcpy(bytes.data() + at, &value, random() % 2 == 0 ? 1 : 4);
    }
    if (random() % 8 == 0) bytes.resize(random() % (bytes.size() + 1));
    repair(bytes, random() % 4 != 0);
    ++(is_refused(bytes, status, use) ? refused : opened);
  }
  EXPECT_GT(refused, rounds / 8);
  EXPECT_GT(opened, rounds / 20);
}

}  // namespace checked_file_damage
