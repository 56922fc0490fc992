// Files of codes that are damaged, or made to do harm.
#include <gtest/gtest.h>

#include <limits>

#include "support/checked_file_damage.h"
#include "support/expect_error.h"
#include "support/samples/tiny_prediction.h"

namespace {

void use_codes(const void* bytes, size_t count) {
  const maq::FrameCodes codes = maq::read_code_file(bytes, count, "codes.maqc");
  const maq::NearestEntry nearest(codes);
  const std::vector<float> features(codes.cells() * codes.groups * codes.width, 0.5f);
  std::vector<uint16_t> found(codes.count());
  nearest.run(features.data(), codes.cells(), found.data());
  for (const uint16_t code : found) EXPECT_LT(code, codes.entries);
}

TEST(CodeFiles, DamageAnywhereIsNoticed) {
  // The head says 2 groups of 1 number each of 2 entries, 1 cell.
  std::string bytes = read_text(tiny_prediction::kBundle + "/codes.maqc").substr(0, 32);
  const uint32_t sizes[4] = {2, 2, 1, 1};
  bytes.append(reinterpret_cast<const char*>(sizes), sizeof sizes);
  const float entries[4] = {0.5f, -1, 2, 3};
  bytes.append(reinterpret_cast<const char*>(entries), sizeof entries);
  bytes.append(2 * 2 + 2 * 2 * 2, '\x08');
  checked_file_damage::repair(bytes, true);
  checked_file_damage::expect_all_damage_noticed(bytes, MAQ_ERROR_BAD_BUNDLE, use_codes);
}

TEST(CodeFiles, WhateverIsInThemIsRefusedOrHarmless) {
  checked_file_damage::expect_random_changes_harmless(read_text(tiny_prediction::kBundle + "/codes.maqc"), 48, 2000,
                                                      MAQ_ERROR_BAD_BUNDLE, use_codes);
}

TEST(CodeFiles, EntriesThatAreNoNumbersAreRefused) {
  for (const float wrong : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(), 1e30f}) {
    std::string bytes = read_text(tiny_prediction::kBundle + "/codes.maqc");
    std::memcpy(bytes.data() + 48 + 4 * 37, &wrong, sizeof wrong);
    checked_file_damage::repair(bytes);
    expect_error(MAQ_ERROR_BAD_BUNDLE, "not finite", [&] { use_codes(bytes.data(), bytes.size()); });
  }
}

}  // namespace
