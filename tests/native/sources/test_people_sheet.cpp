// The sprites of stub:people in their two files.
#include "sources/synthetic/people_sheet.h"

#include <gtest/gtest.h>

#include <set>
#include <vector>

#include "core/files/file.h"
#include "core/module.h"
#include "support/expect_error.h"

namespace {

std::vector<uint8_t> sheet_file(const char* name) { return maq::read_file(maq::find_shared_file(name), 1 << 20); }

TEST(PeopleSheet, AlphaIsInQuartersAndCoversAQuarterOfTheSheet) {
  const maq::BgraImage sheet = maq::read_people_sheet();
  ASSERT_EQ(sheet.pixels.size(), size_t(sheet.width_px) * size_t(sheet.height_px) * 4);
  std::set<int> values;
  size_t covered = 0;
  for (size_t i = 3; i < sheet.pixels.size(); i += 4) {
    values.insert(sheet.pixels[i]);
    covered += sheet.pixels[i] > 127;
  }
  EXPECT_EQ(values, (std::set<int>{0, 64, 128, 191, 255}));
  EXPECT_NEAR(double(covered) * 4 / double(sheet.pixels.size()), 0.25, 0.05);
}

// Tiles are 128 pixels wide. A decision that is read wrongly displaces all that follow.
TEST(PeopleSheet, NobodyReachesTheLastColumnOfATile) {
  const maq::BgraImage sheet = maq::read_people_sheet();
  for (int y = 0; y < sheet.height_px; ++y) {
    for (int x = 127; x < sheet.width_px; x += 128) {
      ASSERT_EQ(sheet.pixels[(size_t(y) * size_t(sheet.width_px) + size_t(x)) * 4 + 3], 0) << x << ", " << y;
    }
  }
}

TEST(PeopleSheet, DamageIsRefusedAndNothingIsReadBeyondTheFiles) {
  const std::vector<uint8_t> colours = sheet_file("stub/people.jpg"), mask = sheet_file("stub/people.mask");
  for (const size_t size : {size_t(0), size_t(3), mask.size() / 2, mask.size() - 1}) {
    const std::vector<uint8_t> part(mask.begin(), mask.begin() + ptrdiff_t(size));
    expect_error(MAQ_ERROR_UNREADABLE, "mask of stub:people", [&] { maq::decode_people_sheet(colours, part); });
  }
  const std::vector<uint8_t> half(colours.begin(), colours.begin() + ptrdiff_t(colours.size() / 2));
  expect_error(MAQ_ERROR_UNREADABLE, "colours of stub:people", [&] { maq::decode_people_sheet(half, mask); });
  expect_error(MAQ_ERROR_UNREADABLE, "colours of stub:people", [&] { maq::decode_people_sheet(mask, mask); });
}

}  // namespace
