// Image files as builds for Android read and write them, with a library in the place of Android's.
#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>

#include "image/clips/clip_reader.h"
#include "image/clips/vp9_encoder.h"
#include "image/files/android/android_images.h"
#include "image/files/image_file.h"
#include "support/expect_error.h"
#include "support/samples/encoded_images.h"
#include "support/temp_folder.h"

extern "C" int fake_create_result, fake_decode_result, fake_compress_result, fake_decoders_alive;

namespace {

using namespace encoded_images;

constexpr int kIncomplete = -1, kAllocationFailed = -3, kInvalidInput = -6, kInternalError = -8;

class AndroidImages : public testing::Test {
 protected:
  void TearDown() override {
    EXPECT_EQ(fake_decoders_alive, 0);
    fake_create_result = fake_decode_result = fake_compress_result = 0;
  }
};

maq::Frame decoded(const Bytes& bytes, maq::Orientation orientation) {
  maq::Frame frame;
  maq::decode_image(bytes, "The image", frame, orientation);
  return frame;
}

void expect_equal(const maq::Frame& frame, const cv::Mat& expected) {
  ASSERT_EQ(frame.image.width_px, expected.cols);
  ASSERT_EQ(frame.image.height_px, expected.rows);
  EXPECT_TRUE(std::equal(frame.storage.begin(), frame.storage.end(), expected.data));
}

TEST_F(AndroidImages, AreRotatedOnceByTheirExifOrientation) {
  const cv::Mat image = smooth(70, 40);
  const Bytes jpeg = encoded(".jpg", image), webp = encoded(".webp", image, {cv::IMWRITE_WEBP_QUALITY, 101});
  for (int orientation = 1; orientation <= 8; ++orientation) {
    for (const bool is_little : {false, true}) {
      SCOPED_TRACE(orientation);
      const Bytes oriented = with_exif(".jpg", jpeg, exif(orientation, is_little));
      expect_equal(decoded(oriented, maq::Orientation::kUpright), cv::imdecode(oriented, cv::IMREAD_COLOR));
      expect_equal(decoded(oriented, maq::Orientation::kAsStored), cv::imdecode(jpeg, cv::IMREAD_COLOR));
      const maq::Frame upright =
          decoded(with_exif(".webp", webp, exif(orientation, is_little)), maq::Orientation::kUpright);
      EXPECT_EQ(upright.image.width_px, orientation < 5 ? 70 : 40);
    }
  }
}

TEST_F(AndroidImages, KeepTheColoursUnderTransparency) {
  cv::Mat image(9, 11, CV_8UC4);
  cv::randu(image, 0, 256);
  const Bytes png = encoded(".png", image);
  expect_equal(decoded(png, maq::Orientation::kUpright), cv::imdecode(png, cv::IMREAD_COLOR));
}

TEST_F(AndroidImages, ThatAreCutOrDamagedSaySo) {
  const Bytes jpeg = encoded(".jpg", smooth(70, 40));
  fake_decode_result = kIncomplete;
  expect_error(MAQ_ERROR_UNREADABLE, "truncated", [&] { decoded(jpeg, maq::Orientation::kUpright); });
  fake_decode_result = kInvalidInput;
  expect_error(MAQ_ERROR_UNREADABLE, "damaged", [&] { decoded(jpeg, maq::Orientation::kUpright); });
  fake_decode_result = 0;
  fake_create_result = kInvalidInput;
  expect_error(MAQ_ERROR_UNREADABLE, "damaged", [&] { decoded(jpeg, maq::Orientation::kUpright); });
  const Bytes cut(jpeg.begin(), jpeg.end() - 40);
  expect_error(MAQ_ERROR_UNREADABLE, "truncated", [&] { decoded(cut, maq::Orientation::kUpright); });
  const Bytes png = encoded(".png", smooth(70, 40));
  expect_error(MAQ_ERROR_UNREADABLE, "damaged", [&] { decoded(png, maq::Orientation::kUpright); });
}

TEST_F(AndroidImages, FailWithoutMemoryAsWithoutMemory) {
  const Bytes jpeg = encoded(".jpg", smooth(70, 40));
  fake_create_result = kInternalError;
  EXPECT_THROW(decoded(jpeg, maq::Orientation::kUpright), std::bad_alloc);
  fake_create_result = 0;
  fake_decode_result = kInternalError;
  EXPECT_THROW(decoded(jpeg, maq::Orientation::kUpright), std::bad_alloc);
  fake_decode_result = 0;
  const maq::Frame frame = decoded(jpeg, maq::Orientation::kUpright);
  fake_compress_result = kAllocationFailed;
  EXPECT_THROW(maq::encode_image(frame.image, ".png"), std::bad_alloc);
  fake_compress_result = -1;
  expect_error(MAQ_ERROR_INTERNAL, "could not be encoded", [&] { maq::encode_image(frame.image, ".png"); });
}

TEST_F(AndroidImages, OverTheLimitAreRefused) {
  const Bytes jpeg = encoded(".jpg", smooth(70, 40));
  maq::JpegDecoder decoder;
  maq::Frame frame;
  EXPECT_FALSE(decoder.decode(jpeg.data(), jpeg.size(), 70 * 40 - 1, frame));
  EXPECT_TRUE(decoder.decode(jpeg.data(), jpeg.size(), 70 * 40, frame));
  const Bytes png = encoded(".png", smooth(70, 40));
  EXPECT_FALSE(decoder.decode(png.data(), png.size(), 70 * 40, frame)) << "a camera sends JPEG";
}

TEST_F(AndroidImages, AreWrittenAsTheyWere) {
  const TempFolder folder;
  const cv::Mat image = smooth(70, 40);
  const maq::Frame frame = decoded(encoded(".png", image), maq::Orientation::kUpright);
  maq::write_image_file(frame.image, folder.file("picture.png"));
  EXPECT_EQ(cv::norm(cv::imread(folder.file("picture.png")), image, cv::NORM_INF), 0);
  maq::write_image_file(frame.image, folder.file("picture.jpg"));
  EXPECT_LT(cv::norm(cv::imread(folder.file("picture.jpg")), image, cv::NORM_INF), 20);
  const std::vector<uint8_t> alpha(70 * 40, 99);
  maq::write_image_file(frame.image, alpha.data(), folder.file("alpha.png"));
  const cv::Mat read = cv::imread(folder.file("alpha.png"), cv::IMREAD_UNCHANGED);
  ASSERT_EQ(read.channels(), 4);
  const cv::Vec4b pixel = read.at<cv::Vec4b>(7, 5);
  EXPECT_EQ(cv::Vec3b(pixel[0], pixel[1], pixel[2]), image.at<cv::Vec3b>(7, 5));
  EXPECT_EQ(pixel[3], 99);

  maq::JpegEncoder encoder;
  Bytes bytes;
  encoder.encode(frame.image, 90, bytes);
  EXPECT_LT(cv::norm(cv::imdecode(bytes, cv::IMREAD_COLOR), image, cv::NORM_INF), 30);
}

TEST_F(AndroidImages, ThatAndroidDoesNotReadSayWhatToDo) {
  const Bytes tiff = encoded(".tiff", smooth(70, 40));
  expect_error(MAQ_ERROR_UNSUPPORTED, "TIFF images are not read on Android",
               [&] { decoded(tiff, maq::Orientation::kUpright); });
  expect_error(MAQ_ERROR_UNSUPPORTED, "MediaCodec", [] { maq::ClipReader("clip.mp4"); });
  expect_error(MAQ_ERROR_UNSUPPORTED, "MediaCodec", [] { maq::Vp9Encoder(64, 48); });
}

}  // namespace
