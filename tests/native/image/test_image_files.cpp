#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>

#include "core/files/file.h"
#include "image/files/image_file.h"
#include "image/files/image_header.h"
#include "support/expect_error.h"
#include "support/temp_folder.h"

namespace {

std::string written_image(const TempFolder& folder, const std::string& name, int width, int height) {
  cv::Mat image(height, width, CV_8UC3);
  cv::randu(image, 0, 256);
  cv::imwrite(folder.file(name), image);
  return folder.file(name);
}

std::vector<uint8_t> bytes_of(const std::string& path) { return maq::read_file(path, 1 << 20); }

TEST(ImageFiles, HeadersTellTheSizeOfEachFormat) {
  const TempFolder folder;
  for (const char* name : {"a.png", "a.jpg", "a.webp", "a.bmp", "a.tiff"}) {
    const auto size = maq::read_image_size(bytes_of(written_image(folder, name, 123, 45)));
    ASSERT_TRUE(size) << name;
    EXPECT_EQ(size->width, 123) << name;
    EXPECT_EQ(size->height, 45) << name;
  }
}

TEST(ImageFiles, HeadersCutAnywhereAreNoSizeAndNoCrash) {
  const TempFolder folder;
  for (const char* name : {"a.png", "a.jpg", "a.webp", "a.bmp", "a.tiff"}) {
    const std::vector<uint8_t> whole = bytes_of(written_image(folder, name, 40, 30));
    const bool is_told_last = std::string(name) == "a.tiff";
    for (size_t length = is_told_last ? whole.size() - 300 : 0; length < std::min<size_t>(whole.size(), 9000);
         length < 700 || is_told_last ? ++length : length += 9000) {
      // A copy of exact size, so that a read past its end is seen by AddressSanitizer.
      const std::vector<uint8_t> cut(whole.begin(), whole.begin() + std::ptrdiff_t(length));
      maq::read_image_size(cut);
    }
  }
}

TEST(ImageFiles, ImagesAreReadAsBgr) {
  const TempFolder folder;
  cv::imwrite(folder.file("red.png"), cv::Mat(3, 5, CV_8UC3, cv::Scalar(10, 20, 200)));
  cv::imwrite(folder.file("grey.png"), cv::Mat(3, 5, CV_8UC1, cv::Scalar(77)));
  cv::imwrite(folder.file("deep.png"), cv::Mat(3, 5, CV_16UC3, cv::Scalar(77 * 257, 77 * 257, 77 * 257)));
  maq::Frame frame;
  maq::read_image_file(folder.file("red.png"), frame);
  EXPECT_EQ(frame.image.width_px, 5);
  EXPECT_EQ(frame.image.height_px, 3);
  EXPECT_EQ(frame.storage[0], 10);
  EXPECT_EQ(frame.storage[2], 200);
  for (const char* name : {"grey.png", "deep.png"}) {
    maq::read_image_file(folder.file(name), frame);
    EXPECT_EQ(frame.storage[0], 77) << name;
    EXPECT_EQ(frame.storage.size(), 45u);
  }
}

TEST(ImageFiles, SizesComeFromTheHeaderOrByDecoding) {
  const TempFolder folder;
  for (const char* name : {"a.png", "a.jpg", "a.tiff"}) {  // the size of a TIFF file lies anywhere in it
    const maq::SizePx size = maq::read_image_file_size(written_image(folder, name, 123, 45));
    EXPECT_EQ(size.width, 123) << name;
    EXPECT_EQ(size.height, 45) << name;
  }
  expect_error(MAQ_ERROR_NOT_FOUND, "does not exist", [&] { maq::read_image_file_size(folder.file("no.jpg")); });
  write_text(folder.file("empty.jpg"), "");
  expect_error(MAQ_ERROR_UNREADABLE, "is empty", [&] { maq::read_image_file_size(folder.file("empty.jpg")); });
  write_text(folder.file("long.jpg"), "");
  std::filesystem::resize_file(folder.file("long.jpg"), (uintmax_t(1) << 30) + 1);  // a hole: it takes no disk
  expect_error(MAQ_ERROR_UNREADABLE, "over 1 GiB", [&] { maq::read_image_file_size(folder.file("long.jpg")); });
}

TEST(ImageFiles, MissingEmptyAndDamagedFilesAreToldApart) {
  const TempFolder folder;
  maq::Frame frame;
  expect_error(MAQ_ERROR_NOT_FOUND, "does not exist", [&] { maq::read_image_file(folder.file("no.jpg"), frame); });
  expect_error(MAQ_ERROR_UNREADABLE, "is not a file but a folder",
               [&] { maq::read_image_file(folder.path().string(), frame); });
  write_text(folder.file("empty.jpg"), "");
  expect_error(MAQ_ERROR_UNREADABLE, "is empty", [&] { maq::read_image_file(folder.file("empty.jpg"), frame); });
  write_text(folder.file("text.jpg"), "this is no image at all, but it is long enough to look for a header in it");
  expect_error(MAQ_ERROR_UNREADABLE, "cannot be decoded",
               [&] { maq::read_image_file(folder.file("text.jpg"), frame); });
  const std::string png = read_text(written_image(folder, "whole.png", 64, 64));
  write_text(folder.file("cut.png"), png.substr(0, 40));
  expect_error(MAQ_ERROR_UNREADABLE, "cannot be decoded", [&] { maq::read_image_file(folder.file("cut.png"), frame); });
}

TEST(ImageFiles, AHeaderOfAHugeImageIsRefusedWithoutDecoding) {
  const TempFolder folder;
  std::string png = read_text(written_image(folder, "a.png", 8, 8));
  png[16] = 0x00, png[17] = 0x01, png[18] = png[19] = 0;  // width 65536
  write_text(folder.file("huge.png"), png);
  maq::Frame frame;
  expect_error(MAQ_ERROR_IMAGE_SIZE, "65536 x 8", [&] { maq::read_image_file(folder.file("huge.png"), frame); });
  png[17] = 0;  // width 0
  write_text(folder.file("none.png"), png);
  expect_error(MAQ_ERROR_IMAGE_SIZE, "0 x 8", [&] { maq::read_image_file(folder.file("none.png"), frame); });
}

}  // namespace
