// People of every number, size and place, on the tiny bundle, whose answers are known (make_tiny_bundle.py).
#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>

#include "densepose/densepose.h"
#include "support/samples/tiny_people.h"

namespace {

// The tiny dense head paints all but the upper quarter of its region, which is wider and higher than the box.
constexpr double kPainted = 0.75 * 1.06 * 1.1;

class DensePosePeople : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    runtime_ = std::make_shared<maq::OnnxRuntimeLibrary>(MAQ_TEST_ONNXRUNTIME, maq::Log());
  }
  static void TearDownTestSuite() { runtime_.reset(); }

  static maq::DensePoseResult run(const cv::Mat& bgr, const maq::DensePoseSettings& settings = {}) {
    maq::DensePose densepose(runtime_, maq::read_bundle(std::string(MAQ_TEST_DATA) + "/tiny_bundle"), settings);
    maq::DensePoseResult result;
    densepose.run({MAQ_PIXEL_BGR8, bgr.cols, bgr.rows, {{bgr.data, bgr.step}, {}}}, result);
    return result;
  }

  static int64_t pixels_of(const maq::DensePoseResult& result, size_t person) {
    return std::count(result.planes.person.begin(), result.planes.person.end(), uint8_t(person));
  }

  static std::shared_ptr<const maq::OnnxRuntimeLibrary> runtime_;
};

std::shared_ptr<const maq::OnnxRuntimeLibrary> DensePosePeople::runtime_;

TEST_F(DensePosePeople, EachOfNoneOneTwoAndThirtyIsFoundWhereItIsAndPainted) {
  for (const int count : {0, 1, 2, 30}) {
    cv::Mat image = black(320, 256);
    std::vector<cv::Point> cells;
    for (int k = 0; k < count; ++k) cells.emplace_back(20 + 52 * (k % 6), 24 + 48 * (k / 6));
    for (const cv::Point& cell : cells) image(cv::Rect(cell, cv::Size(4, 4))) = kRed;
    maq::DensePoseSettings settings;
    settings.max_people = 30;
    const maq::DensePoseResult result = run(image, settings);
    ASSERT_EQ(result.people.size(), size_t(count));
    EXPECT_EQ(result.stats.dense_head_ms > 0, count > 0) << "the dense head runs only where there are people";
    for (const cv::Point& cell : cells) {
      size_t found = 0;
      for (size_t k = 0; k < result.people.size(); ++k) {
        const maq::Box& box = result.people[k].box;
        if (std::abs(box.x0 - float(cell.x - 16 + 3.2)) > 1e-3 || std::abs(box.y0 - float(cell.y - 16)) > 1e-3)
          continue;
        ++found;
        EXPECT_NEAR(box.x1, cell.x + 16 + 3.2, 1e-3);
        EXPECT_NEAR(box.y1, cell.y + 16, 1e-3);
        EXPECT_NEAR(double(pixels_of(result, k + 1)), kPainted * 32 * 32, 50);
      }
      EXPECT_EQ(found, 1u) << cell;
    }
  }
}

TEST_F(DensePosePeople, OneOf12PixelsIsFoundInASmallFrame) {
  cv::Mat image = black(120, 96);  // enters the network at 320 x 256, where the least person is 32 px
  image(cv::Rect(60, 48, 2, 2)) = kRed;
  const maq::DensePoseResult result = run(image);
  ASSERT_GE(result.people.size(), 1u);
  EXPECT_NEAR(result.people[0].box.height(), 12, 1e-3);
  EXPECT_NEAR(double(pixels_of(result, 1)), kPainted * 12 * 12, 20);
}

TEST_F(DensePosePeople, OneTruncatedByABorderStaysInsideTheFrame) {
  for (const cv::Point& cell : {cv::Point(8, 120), {308, 120}, {160, 8}, {160, 244}, {8, 8}, {308, 244}}) {
    cv::Mat image = black(320, 256);
    image(cv::Rect(cell, cv::Size(4, 4))) = kRed;
    maq::DensePoseSettings settings;
    settings.max_proposals = 1;  // of equal objectness the anchors of the first rows come next, and see it as well
    const maq::DensePoseResult result = run(image, settings);
    ASSERT_EQ(result.people.size(), 1u) << cell;
    // The anchor is clipped first; the box head then moves what is left by a tenth of its width, and that is clipped.
    const float x0 = float(std::max(cell.x - 16, 0)), x1 = float(std::min(cell.x + 16, 320));
    const maq::Box& box = result.people[0].box;
    EXPECT_NEAR(box.x0, x0 + (x1 - x0) / 10, 1e-3) << cell;
    EXPECT_NEAR(box.x1, std::min(x1 + (x1 - x0) / 10, 320.0f), 1e-3) << cell;
    EXPECT_NEAR(box.y0, std::max(cell.y - 16, 0), 1e-3) << cell;
    EXPECT_NEAR(box.y1, std::min(cell.y + 16, 256), 1e-3) << cell;
    EXPECT_GT(pixels_of(result, 1), 0) << cell;
  }
}

TEST_F(DensePosePeople, OneFillingTheFrameIsPaintedToItsEdges) {
  cv::Mat image = black(128, 128);
  image(cv::Rect(64, 64, 16, 16)) = kBlue;  // a person of 128 px
  maq::DensePoseSettings settings;
  settings.long_side_px = 128;
  const maq::DensePoseResult result = run(image, settings);
  ASSERT_EQ(result.people.size(), 1u);
  const maq::Box& box = result.people[0].box;
  EXPECT_NEAR(box.x0, 12.8, 1e-3);
  EXPECT_EQ(box.x1, 128);
  EXPECT_EQ(box.y0, 0);
  EXPECT_EQ(box.y1, 128);
  for (const int x : {12, 70, 127}) EXPECT_EQ(result.planes.person[size_t(127 * 128 + x)], 1) << x;
}

}  // namespace
