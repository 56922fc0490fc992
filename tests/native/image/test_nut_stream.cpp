#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "core/files/unique_fd.h"
#include "image/clips/nut_stream.h"
#include "support/temp_folder.h"

namespace {

// Three images of FFmpeg's test pattern: 8 x 6, five a second.
const std::string kClip = MAQ_TEST_DATA "/clips/test_pattern.nut";

// The times of all images that a file gives.
std::vector<int64_t> times_of(const std::string& path) {
  const maq::UniqueFd file(open(path.c_str(), O_RDONLY | O_CLOEXEC));
  maq::NutStream stream(file.get());
  std::vector<int64_t> times;
  std::vector<uint8_t> pixels;
  for (int64_t time_ns = 0; stream.read(pixels, time_ns); times.push_back(time_ns)) {
    EXPECT_EQ(pixels.size(), 8u * 6 * 3);
  }
  return times;
}

TEST(NutStream, GivesImagesWithTheirTimes) {
  const maq::UniqueFd file(open(kClip.c_str(), O_RDONLY | O_CLOEXEC));
  const maq::NutStream stream(file.get());
  EXPECT_TRUE(stream.is_open());
  EXPECT_EQ(stream.width_px(), 8);
  EXPECT_EQ(stream.height_px(), 6);
  EXPECT_EQ(times_of(kClip), (std::vector<int64_t>{0, 200'000'000, 400'000'000}));
}

TEST(NutStream, EndsWhereTheStreamDoes) {
  const TempFolder folder;
  const std::string whole = read_text(kClip);
  size_t most = 0;
  for (size_t length = 0; length < whole.size(); ++length) {
    write_text(folder.file("cut.nut"), whole.substr(0, length));
    const size_t images = times_of(folder.file("cut.nut")).size();
    EXPECT_GE(images, most) << length;
    most = images;
  }
  EXPECT_GE(most, 2u);
}

TEST(NutStream, StaysSaneWithAnyByteChanged) {
  const TempFolder folder;
  const std::string whole = read_text(kClip);
  for (size_t at = 0; at < whole.size(); ++at) {
    for (const char change : {char(0x80), char(0x7f), char(0xff)}) {
      std::string changed = whole;
      changed[at] = char(changed[at] ^ change);
      write_text(folder.file("changed.nut"), changed);
      const maq::UniqueFd file(open(folder.file("changed.nut").c_str(), O_RDONLY | O_CLOEXEC));
      maq::NutStream stream(file.get());
      if (!stream.is_open() || stream.width_px() * stream.height_px() > 1 << 20) continue;
      std::vector<uint8_t> pixels;
      int64_t time_ns = 0;
      int images = 0;
      while (images < 9 && stream.read(pixels, time_ns)) ++images;
      EXPECT_LT(images, 9) << at;
    }
  }
}

}  // namespace
