// Images of each format are read as OpenCV decodes them.
#include <gtest/gtest.h>
#include <turbojpeg.h>

#include <iostream>
#include <opencv2/imgcodecs.hpp>
#include <random>

#include "image/files/image_file.h"
#include "image/files/image_header.h"
#include "image/files/jpeg.h"
#include "support/expect_error.h"
#include "support/samples/encoded_images.h"

namespace {

using namespace encoded_images;

cv::Mat noise(int width, int height, int type = CV_8UC3) {
  cv::Mat image(height, width, type);
  cv::randu(image, 0, type == CV_16UC3 ? 65536 : 256);
  return image;
}

maq::Frame decoded(const Bytes& bytes, maq::Orientation orientation = maq::Orientation::kUpright) {
  maq::Frame frame;
  maq::decode_image(bytes, "The image", frame, orientation);
  return frame;
}

void expect_as_opencv(const Bytes& bytes, const std::string& what) {
  const cv::Mat expected = cv::imdecode(bytes, cv::IMREAD_COLOR);
  const maq::Frame frame = decoded(bytes);
  ASSERT_EQ(frame.image.width_px, expected.cols) << what;
  ASSERT_EQ(frame.image.height_px, expected.rows) << what;
  ASSERT_TRUE(expected.isContinuous());
  EXPECT_TRUE(std::equal(frame.storage.begin(), frame.storage.end(), expected.data)) << what;
}

TEST(ImageFormats, JpegIsDecodedToTheBitAsByOpenCv) {
  for (const int width : {64, 65, 47}) {
    const cv::Mat image = smooth(width, 33);
    expect_as_opencv(encoded(".jpg", image), "4:2:0");
    expect_as_opencv(encoded(".jpg", noise(width, 31)), "noise");
    expect_as_opencv(encoded(".jpg", noise(width, 31, CV_8UC1)), "grey");
    expect_as_opencv(encoded(".jpg", image, {cv::IMWRITE_JPEG_PROGRESSIVE, 1}), "progressive");
    expect_as_opencv(encoded(".jpg", image, {cv::IMWRITE_JPEG_RST_INTERVAL, 2}), "restart markers");
  }
}

TEST(ImageFormats, JpegOfPrintersColoursAndEverySubsamplingIsDecodedAsByOpenCv) {
  const cv::Mat bgr = smooth(61, 35), cmyk = noise(61, 35, CV_8UC4);
  tjhandle encoder = tjInitCompress();
  for (const auto& [image, format] : {std::pair(bgr, int(TJPF_BGR)), std::pair(cmyk, int(TJPF_CMYK))}) {
    for (const int subsampling : {TJSAMP_444, TJSAMP_422, TJSAMP_420, TJSAMP_440, TJSAMP_411}) {
      Bytes bytes(tjBufSize(61, 35, subsampling) * 2);
      uint8_t* target = bytes.data();
      unsigned long size = bytes.size();
      ASSERT_EQ(tjCompress2(encoder, image.data, 61, 0, 35, format, &target, &size, subsampling, 90, TJFLAG_NOREALLOC),
                0);
      bytes.resize(size);
      expect_as_opencv(bytes, "subsampling " + std::to_string(subsampling));
    }
  }
  tjDestroy(encoder);
}

TEST(ImageFormats, ACutJpegIsRefused) {
  for (const int is_progressive : {0, 1}) {
    const Bytes whole = encoded(".jpg", smooth(160, 120), {cv::IMWRITE_JPEG_PROGRESSIVE, is_progressive});
    for (size_t length = 800; length < whole.size(); length += 97) {
      Bytes cut(whole.begin(), whole.begin() + ptrdiff_t(length));
      expect_error(MAQ_ERROR_UNREADABLE, "is truncated", [&] { decoded(cut); });
      cut.resize(whole.size());  // as downloads that were given up are
      expect_error(MAQ_ERROR_UNREADABLE, "", [&] { decoded(cut); });
    }
    const Bytes without_end(whole.begin(), whole.end() - 2);
    expect_error(MAQ_ERROR_UNREADABLE, "is truncated", [&] { decoded(without_end); });
  }
  const Bytes whole = encoded(".jpg", smooth(160, 120));
  Bytes closed(whole.begin(), whole.begin() + ptrdiff_t(whole.size() / 2));
  append(closed, {0xff, 0xd9});
  expect_error(MAQ_ERROR_UNREADABLE, "is truncated", [&] { decoded(closed); });
}

TEST(ImageFormats, WhatIsHarmlessInAJpegIsNoDamage) {
  const Bytes whole = encoded(".jpg", smooth(64, 48));
  Bytes padded(whole.begin(), whole.end() - 2);
  append(padded, {1, 2, 3, 0xff, 0xd9});
  EXPECT_EQ(decoded(padded).storage, decoded(whole).storage);
  Bytes followed = whole;
  append(followed, text("as phones append a clip"));
  EXPECT_EQ(decoded(followed).storage, decoded(whole).storage);
}

TEST(ImageFormats, PngIsDecodedAsByOpenCv) {
  for (const int type : {CV_8UC3, CV_8UC1, CV_8UC4, CV_16UC3})
    expect_as_opencv(encoded(".png", noise(37, 23, type)), "PNG");
  expect_as_opencv(encoded(".png", noise(37, 23, CV_8UC1), {cv::IMWRITE_PNG_BILEVEL, 1}), "one bit a pixel");
}

TEST(ImageFormats, OtherFormatsAreDecodedAsByOpenCv) {
  for (const char* extension : {".webp", ".bmp", ".tiff"})
    expect_as_opencv(encoded(extension, noise(37, 23)), extension);
  for (const char* extension : {".bmp", ".tiff"})
    expect_as_opencv(encoded(extension, noise(37, 23, CV_8UC1)), std::string("grey ") + extension);
  expect_as_opencv(encoded(".tiff", noise(300, 200, CV_16UC3)), "16 bits");
  constexpr int kNone = 1, kLzw = 5, kDeflate = 32946, kPackBits = 32773;
  for (const int compression : {kNone, kLzw, kDeflate, kPackBits}) {
    const std::vector<int> options = {cv::IMWRITE_TIFF_COMPRESSION, compression};
    const std::string what = "TIFF compression " + std::to_string(compression);
    expect_as_opencv(encoded(".tiff", smooth(301, 203), options), what);
    expect_as_opencv(encoded(".tiff", noise(301, 203), options), what + ", noise");
    expect_as_opencv(encoded(".tiff", cv::Mat(203, 301, CV_8UC3, cv::Scalar(7, 8, 9)), options), what + ", one colour");
  }
}

TEST(ImageFormats, ImagesAreEncodedAsByOpenCv) {
  for (const cv::Mat& image : {smooth(37, 23), noise(64, 48), noise(33, 17, CV_8UC1)}) {
    const maq::ImageView view{image.channels() == 1 ? MAQ_PIXEL_GREY8 : MAQ_PIXEL_BGR8,
                              image.cols,
                              image.rows,
                              {{image.data, image.step}, {}}};
    for (const char* extension : {".png", ".jpg"}) {
      EXPECT_EQ(maq::encode_image(view, extension), encoded(extension, image)) << extension << ' ' << image.channels();
    }
  }
}

TEST(ImageFormats, ImagesAreUprightByTheirExifOrientation) {
  const cv::Mat image = smooth(70, 41);
  const Bytes jpeg = encoded(".jpg", image), webp = encoded(".webp", image, {cv::IMWRITE_WEBP_QUALITY, 101});
  for (int orientation = 1; orientation <= 8; ++orientation) {
    for (const bool is_little : {true, false}) {
      const Bytes facts = exif(orientation, is_little);
      expect_as_opencv(with_exif(".jpg", jpeg, facts), "orientation " + std::to_string(orientation));
      // OpenCV rotates JPEG images, but no WebP images: a JPEG image of the same size is the reference.
      const maq::Frame upright = decoded(with_exif(".webp", webp, facts));
      const cv::Mat expected =
          cv::imdecode(with_exif(".jpg", encoded(".jpg", image, {cv::IMWRITE_JPEG_QUALITY, 100}), facts), 1);
      ASSERT_EQ(upright.image.width_px, expected.cols);
      const cv::Mat found(expected.rows, expected.cols, CV_8UC3, const_cast<uint8_t*>(upright.storage.data()));
      EXPECT_LT(cv::norm(found, expected, cv::NORM_INF), 20) << orientation;
      const Bytes oriented = with_exif(".webp", webp, facts);
      EXPECT_EQ(decoded(oriented, maq::Orientation::kAsStored).image.width_px, 70);
    }
  }
  EXPECT_EQ(decoded(with_exif(".jpg", jpeg, exif(9, true))).image.width_px, 70) << "no orientation";
}

TEST(ImageFormats, DamagedExifIsNoOrientationAndNoCrash) {
  std::mt19937 random(1);
  const Bytes image = encoded(".jpg", smooth(16, 8));
  for (int i = 0; i < 2000; ++i) {
    Bytes facts = exif(6, i % 2 == 0);
    for (int k = 0; k < 3; ++k) facts[random() % facts.size()] = uint8_t(random());
    const Bytes damaged =
        with_exif(i % 3 == 0 ? ".webp" : ".jpg", i % 3 == 0 ? encoded(".webp", smooth(16, 8)) : image, facts);
    Bytes cut(damaged.begin(), damaged.begin() + ptrdiff_t(random() % damaged.size()));
    cut.shrink_to_fit();
    EXPECT_GE(maq::read_exif_orientation(damaged), 1);
    EXPECT_GE(maq::read_exif_orientation(cut), 1);
  }
}

TEST(ImageFormats, FormatsThatAreNotReadAreNamed) {
  const std::string zeros(64, 0);
  const std::pair<std::string, const char*> others[] = {
      {std::string("\0\0\0\x18"
                   "ftypheic",
                   12) +
           zeros,
       "a HEIC image"},
      {std::string("\0\0\0\x18"
                   "ftypmif1",
                   12) +
           zeros,
       "a HEIC image"},
      {std::string("\0\0\0\x18"
                   "ftypavif",
                   12) +
           zeros,
       "an AVIF image"},
      {"GIF89a" + zeros, "a GIF image"},
      {std::string("RIFF\x40\0\0\0WEBPVP8X\x0a\0\0\0\x02\0\0\0", 24) + zeros, "an animated WebP image"},
      {std::string("\0\0\2\0\0\0\0\0\0\0\0\0\x10\0\x10\0\x18\0", 18) + zeros, "a TGA image"},
      {"<?xml version=\"1.0\"?><svg width=\"3\"></svg>", "an SVG drawing"},
      {"<svg xmlns=\"http://www.w3.org/2000/svg\"/>", "an SVG drawing"},
      {"P6\n3 2\n255\n" + zeros, "a PNM image"},
      {"8BPS" + zeros, "a Photoshop image"},
      {"%PDF-1.7" + zeros, "a PDF document"}};
  for (const auto& [bytes, name] : others) {
    expect_error(MAQ_ERROR_UNSUPPORTED, std::string(name) + ", which is not read; save it as JPEG",
                 [&, &bytes = bytes] { decoded(text(bytes)); });
  }
  const std::string clip = std::string(
                               "\0\0\0\x18"
                               "ftypisom",
                               12) +
                           zeros;
  expect_error(MAQ_ERROR_UNSUPPORTED, "an MP4 or MOV video, no image", [&] { decoded(text(clip)); });
  expect_error(MAQ_ERROR_UNREADABLE, "damaged or no image", [&] { decoded(text("just words, " + zeros)); });
  expect_error(MAQ_ERROR_UNREADABLE, "is empty", [&] { decoded({}); });
}

TEST(ImageFormats, NothingIsPrintedOfDamagedImages) {
  std::mt19937 random(1);
  testing::internal::CaptureStderr();
  for (const char* extension : {".jpg", ".png", ".webp", ".bmp", ".tiff"}) {
    const Bytes whole = encoded(extension, noise(40, 30));
    for (int i = 0; i < 200; ++i) {
      Bytes damaged = whole;
      if (i % 2 == 0) damaged.resize(random() % damaged.size());
      for (size_t k = 0; k < 4 && !damaged.empty(); ++k) damaged[random() % damaged.size()] = uint8_t(random());
      damaged.shrink_to_fit();
      try {
        decoded(damaged);
      } catch (const maq::Error& error) {
        EXPECT_NE(error.status(), MAQ_ERROR_INTERNAL) << error.what();
      }
    }
  }
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
  testing::internal::CaptureStderr();
  std::cerr << "what the app says";
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "what the app says");
}

}  // namespace
