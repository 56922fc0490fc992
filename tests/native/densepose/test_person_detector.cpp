// The detector alone on the tiny bundle, which sees a person in a cell of colour (make_tiny_bundle.py).
#include "densepose/detector/person_detector.h"

#include <gtest/gtest.h>

#include "support/expect_error.h"
#include "support/samples/tiny_dense_pose.h"
#include "support/samples/tiny_people.h"

namespace {

class PersonDetector : public ::testing::Test {
 protected:
  std::vector<maq::ScoredBox> find(const cv::Mat& image, const std::vector<maq::ScoredBox>* followed = nullptr,
                                   float min_score = 0.5f) {
    stats_ = {};
    return detector_.run(TinyDensePose::view(image), TinyDensePose::unscaled(image), followed, min_score, tiny_.cancel,
                         stats_);
  }

  TinyDensePose tiny_;
  maq::PersonDetector detector_{tiny_.networks, tiny_.spec, tiny_.settings};
  maq::DetectorStats stats_;
};

TEST_F(PersonDetector, FindsACellOfColourAndNothingInBlack) {
  cv::Mat image = black(320, 256);
  EXPECT_TRUE(find(image).empty());
  image(cv::Rect(80, 100, 4, 4)) = kRed;
  const std::vector<maq::ScoredBox> found = find(image);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_NEAR(found[0].box.x0, 80 - 16 + 3.2, 1e-3);
  EXPECT_NEAR(found[0].box.y1, 100 + 16, 1e-3);
  EXPECT_GT(found[0].score, 0.9);
  EXPECT_GT(stats_.proposals, 0);
  EXPECT_TRUE(find(image, nullptr, found[0].score).empty()) << "scores must be above the minimum";
}

TEST_F(PersonDetector, FollowedBoxesTakeThePlaceOfProposals) {
  cv::Mat image = black(320, 256);
  image(cv::Rect(80, 100, 4, 4)) = kRed;
  image(cv::Rect(200, 128, 8, 8)) = kGreen;
  const std::vector<maq::ScoredBox> both = find(image);
  ASSERT_EQ(both.size(), 2u);
  const std::vector<maq::ScoredBox> one{both[0]};
  EXPECT_EQ(find(image, &one).size(), 1u);
  EXPECT_EQ(stats_.proposals, 1);
  const std::vector<maq::ScoredBox> none;
  EXPECT_TRUE(find(image, &none).empty());
}

TEST_F(PersonDetector, ACancelledRunEnds) {
  tiny_.cancel.cancel();
  expect_error(MAQ_CANCELLED, "", [&] { find(black(320, 256)); });
}

}  // namespace
