// Sources of depth from files and recordings, and the calibration that their URIs give.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <fstream>
#include <opencv2/imgcodecs.hpp>

#include "sources/recording/recording.h"
#include "sources/registry.h"
#include "support/expect_error.h"
#include "support/temp_folder.h"

namespace {

using maq::NextFrame;

class DepthSources : public ::testing::Test {
 protected:
  std::string depth_png(int width = 40, int height = 30) const {
    cv::Mat image(height, width, CV_16UC1);
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) image.at<uint16_t>(y, x) = uint16_t(500 + 3 * x + y);
    }
    cv::imwrite(folder_.file("depth.png"), image);
    return folder_.file("depth.png");
  }
  std::unique_ptr<maq::Source> open(const std::string& options) const {
    return maq::open_source("image:" + depth_png() + options);
  }
  void expect_refused(const std::string& options, const std::string& part_of_text,
                      maq_status status = MAQ_ERROR_INVALID_ARGUMENT) const {
    expect_error(status, part_of_text, [&] { open(options); });
  }

  const TempFolder folder_;
};

TEST_F(DepthSources, AnImageIsDepthWhereAUnitIsGiven) {
  maq::Frame frame;
  ASSERT_EQ(open("?depth_unit=0.001")->next(0, frame), NextFrame::kFrame);
  EXPECT_EQ(frame.image.format, MAQ_PIXEL_DEPTH16);
  ASSERT_EQ(open("?depth_unit=0.0001")->next(0, frame), NextFrame::kFrame);
  EXPECT_EQ(frame.image.format, MAQ_PIXEL_DEPTH32F);
  float metres = 0;
  std::memcpy(&metres, frame.image.planes[0].data + 4 * (2 * 40 + 7), 4);
  EXPECT_FLOAT_EQ(metres, 0.0523f);
  expect_refused("", "depth.png?depth_unit=0.001&fov=60", MAQ_ERROR_UNSUPPORTED);
  for (const int type : {CV_16UC1, CV_32FC1}) {
    cv::imwrite(folder_.file("depth.tiff"), cv::Mat(30, 40, type, cv::Scalar(2)));
    expect_error(MAQ_ERROR_UNSUPPORTED, "as depth cameras write it",
                 [&] { maq::open_source(folder_.file("depth.tiff")); });
  }
  cv::imwrite(folder_.file("photo.png"), cv::Mat(30, 40, CV_16UC3, cv::Scalar(2)));
  ASSERT_EQ(maq::open_source(folder_.file("photo.png"))->next(0, frame), NextFrame::kFrame);
  EXPECT_EQ(frame.image.format, MAQ_PIXEL_BGR8) << "16 bits in colour are a photo";
  for (const char* unit : {"0", "-1", "nan", "inf", "1e9", "mm", ""}) {
    expect_refused(std::string("?depth_unit=") + unit, "depth_unit=");
  }
  expect_refused("?depth_unit=0.001&size=20x15", "is depth, which is not scaled", MAQ_ERROR_UNSUPPORTED);
}

TEST_F(DepthSources, HaveTheCalibrationThatIsGiven) {
  EXPECT_EQ(open("?depth_unit=0.001")->intrinsics(), nullptr) << "none is made up";
  const auto by_fov = open("?depth_unit=0.001&fov=60");
  ASSERT_NE(by_fov->intrinsics(), nullptr);
  EXPECT_EQ(by_fov->intrinsics()->width_px, 40);
  EXPECT_EQ(by_fov->intrinsics()->height_px, 30);
  EXPECT_NEAR(by_fov->intrinsics()->fx_px, 20 * std::sqrt(3), 1e-12);
  EXPECT_EQ(by_fov->intrinsics()->fy_px, by_fov->intrinsics()->fx_px);
  EXPECT_EQ(by_fov->intrinsics()->cx_px, 19.5);
  EXPECT_EQ(by_fov->intrinsics()->cy_px, 14.5);
  for (const double coefficient : by_fov->intrinsics()->distortion) EXPECT_EQ(coefficient, 0);
  const auto by_focal = open("?depth_unit=0.001&fx=35&fy=36&cx=-4.5&cy=100");
  EXPECT_EQ(by_focal->intrinsics()->fx_px, 35);
  EXPECT_EQ(by_focal->intrinsics()->fy_px, 36);
  EXPECT_EQ(by_focal->intrinsics()->cx_px, -4.5);
  EXPECT_EQ(by_focal->intrinsics()->cy_px, 100);
  cv::imwrite(folder_.file("photo.png"), cv::Mat(30, 40, CV_8UC3, cv::Scalar(2)));
  const std::string photo = "image:" + folder_.file("photo.png");
  EXPECT_EQ(maq::open_source(photo + "?fx=35")->intrinsics()->fy_px, 35) << "of photos too; square pixels";
  const auto scaled = maq::open_source(photo + "?fx=40&fy=40&cx=9.5&size=20x15");
  EXPECT_EQ(scaled->intrinsics()->width_px, 20);
  EXPECT_EQ(scaled->intrinsics()->fx_px, 20) << "it is of the picture as stored";
  EXPECT_EQ(scaled->intrinsics()->cx_px, 4.5);
  EXPECT_EQ(open("?depth_unit=0.001&fov=60&live=1")->intrinsics()->cx_px, 19.5);
}

TEST_F(DepthSources, ACalibrationThatCannotBeIsRefused) {
  for (const char* wrong :
       {"fx=0", "fx=-300", "fx=nan", "fov=0", "fov=180", "fov=-60", "fov=wide", "fov=60&cx=inf", "fx=300&fy=0"}) {
    const std::string text = wrong;
    expect_refused("?depth_unit=0.001&" + text, text.substr(text.find_last_of('&') + 1) + " in ");
  }
  expect_refused("?fov=60&fx=300", "does not go with fx");
  expect_refused("?fov=60&fy=300", "does not go with fx");
  for (const char* part : {"fy=300", "cx=3", "cy=3"}) expect_refused(std::string("?") + part, "needs fx");
  expect_refused("?depth_unit=0.001&focal=3", "depth_unit, fov, fx");
}

TEST_F(DepthSources, ARecordingOfDepthHasItsFramesAndItsCalibration) {
  const auto from = open("?depth_unit=0.0001&fov=60");
  maq::Frame frame;
  ASSERT_EQ(from->next(0, frame), NextFrame::kFrame);
  for (const int quality : {0, 90}) {
    const std::string path = folder_.file("take" + std::to_string(quality) + ".maqrec");
    maq::RecordingWriter writer(path, {"image:depth.png", 30, *from->intrinsics()}, quality);
    writer.add(frame);
    writer.finish();
    const auto back = maq::open_source("rec:" + path);
    ASSERT_NE(back->intrinsics(), nullptr);
    EXPECT_EQ(std::memcmp(back->intrinsics(), from->intrinsics(), sizeof(maq_intrinsics)), 0);
    maq::Frame replayed;
    ASSERT_EQ(back->next(0, replayed), NextFrame::kFrame);
    EXPECT_EQ(replayed.image.format, MAQ_PIXEL_DEPTH32F) << "never JPEG";
    EXPECT_EQ(replayed.storage, frame.storage);
  }
}

}  // namespace
