#include <gtest/gtest.h>

#include "sources/uri.h"
#include "support/expect_error.h"

namespace {

using maq::parse_source_uri;

TEST(Uri, SplitsIntoSchemeTargetAndOptions) {
  const maq::SourceUri uri = parse_source_uri("stub:people?count=2&fps=12.5&seed=7&size=640x480");
  EXPECT_EQ(uri.scheme, "stub");
  EXPECT_EQ(uri.target, "people");
  EXPECT_EQ(uri.width_px, 640);
  EXPECT_EQ(uri.height_px, 480);
  EXPECT_DOUBLE_EQ(uri.fps, 12.5);
  EXPECT_EQ(uri.options.size(), 2u);
  EXPECT_EQ(uri.options.at("count"), "2");
}

TEST(Uri, KeepsPathsAsTheyAreAndDecodesPercents) {
  EXPECT_EQ(parse_source_uri("image:/a b/c:d.jpg").target, "/a b/c:d.jpg");
  EXPECT_EQ(parse_source_uri("image:what%3F.jpg").target, "what?.jpg");
  EXPECT_EQ(parse_source_uri("image:100%25.jpg").target, "100%.jpg");
  EXPECT_EQ(parse_source_uri("image:100%.jpg").target, "100%.jpg");
}

TEST(Uri, RefusesAZeroByteWhichWouldCutANameShort) {
  for (const char* text : {"image:photo.jpg%00.png", "rec:a?size=16x16&x=%00", "rec:a?%00=1"}) {
    expect_error(MAQ_ERROR_INVALID_ARGUMENT, "zero byte (%00)", [&] { parse_source_uri(text); });
  }
}

TEST(Uri, RefusesWhatIsNoUri) {
  for (const char* text : {"", "photo.jpg", ":photo.jpg", "dir/a:b", " image:x"}) {
    expect_error(MAQ_ERROR_INVALID_ARGUMENT, "is not a source", [&] { parse_source_uri(text); });
  }
}

TEST(Uri, RefusesIllFormedOptionsAndNamesThem) {
  expect_error(MAQ_ERROR_INVALID_ARGUMENT, "\"loop\" of", [] { parse_source_uri("video:a.mp4?loop"); });
  expect_error(MAQ_ERROR_INVALID_ARGUMENT, "\"\" of", [] { parse_source_uri("video:a.mp4?"); });
  expect_error(MAQ_ERROR_INVALID_ARGUMENT, "\"=3\" of", [] { parse_source_uri("video:a.mp4?=3"); });
  expect_error(MAQ_ERROR_INVALID_ARGUMENT, "given twice", [] { parse_source_uri("video:a.mp4?fps=1&fps=2"); });
}

TEST(Uri, RefusesNumbersOutOfRange) {
  for (const char* size : {"640", "640x", "x480", "axb", "640x480x3"}) {
    expect_error(MAQ_ERROR_INVALID_ARGUMENT, "is not a size",
                 [&] { parse_source_uri(std::string("stub:people?size=") + size); });
  }
  for (const char* size : {"0x480", "640x-1", "20000x20", "16384x16384", "9000000000x2"}) {
    expect_error(MAQ_ERROR_IMAGE_SIZE, "pixels", [&] { parse_source_uri(std::string("stub:people?size=") + size); });
  }
  for (const char* fps : {"0", "-5", "nan", "inf", "1e9", "", "30fps"}) {
    expect_error(MAQ_ERROR_INVALID_ARGUMENT, "must be a number",
                 [&] { parse_source_uri(std::string("stub:people?fps=") + fps); });
  }
}

TEST(Uri, TakesEachOptionOnceAndComplainsAboutTheRest) {
  maq::SourceUri uri = parse_source_uri("stub:people?count=5&speed=2");
  EXPECT_EQ(uri.take_integer("count", 1, 0, 30), 5);
  EXPECT_EQ(uri.take_integer("count", 1, 0, 30), 1);
  expect_error(MAQ_ERROR_INVALID_ARGUMENT, "speed", [&] { uri.expect_no_more_options("count"); });
  for (const char* count : {"31", "-1", "2.5", "two", "99999999999999999999"}) {
    maq::SourceUri wrong = parse_source_uri(std::string("stub:people?count=") + count);
    expect_error(MAQ_ERROR_INVALID_ARGUMENT, "whole number from 0 to 30",
                 [&] { wrong.take_integer("count", 1, 0, 30); });
  }
}

}  // namespace
