// Numbers in text as builds for Android read them, whose C++ library has no std::from_chars for them.
#include <gtest/gtest.h>

#include <cmath>

#include "core/files/file_reader.h"

namespace {

TEST(AndroidNumbers, AreThoseOfC) {
  const std::pair<const char*, double> numbers[] = {{"0", 0},     {"-1.5", -1.5}, {"+2", 2},          {"1e3", 1000},
                                                    {".25", .25}, {"1e-400", 0},  {"1e400", HUGE_VAL}};
  for (const auto& [text, expected] : numbers) {
    double number = -1;
    EXPECT_TRUE(maq::parse_number(text, number)) << text;
    EXPECT_EQ(number, expected) << text;
  }
}

TEST(AndroidNumbers, OtherTextIsNone) {
  for (const char* text : {"", "+", "-", " 1", "1 ", "++1", "0x10", "1,5", "1.5.2", "one", "1e"}) {
    double number = 0;
    EXPECT_FALSE(maq::parse_number(text, number)) << text;
  }
  double number = 0;
  EXPECT_FALSE(maq::parse_number(std::string_view("1\0", 2), number));
}

}  // namespace
