// The shipped encoder and prior on everyday photos, and on images that show no head.
#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <utility>
#include <vector>

#include "head/shipped_heads.h"

namespace shipped_heads {
namespace {

TEST_F(ShippedHeads, GreyDarkBrightAndBadPhotosShowTheSameHead) {
  const Made as_it_is = make(photo_);
  expect_sound(as_it_is);
  EXPECT_LT(std::abs(as_it_is.yaw_deg()), 30);
  cv::Mat grey, dark, bright, blurred, warm, compressed;
  cv::cvtColor(photo_, grey, cv::COLOR_BGR2GRAY);
  cv::cvtColor(grey, grey, cv::COLOR_GRAY2BGR);
  photo_.convertTo(dark, -1, 0.25);
  photo_.convertTo(bright, -1, 2.2, 10);  // the face is white for the most part
  cv::GaussianBlur(photo_, blurred, {}, 2);
  cv::multiply(photo_, cv::Scalar(0.6, 0.9, 1.3), warm);
  std::vector<uint8_t> jpeg;
  cv::imencode(".jpg", photo_, jpeg, {cv::IMWRITE_JPEG_QUALITY, 15});
  compressed = cv::imdecode(jpeg, cv::IMREAD_COLOR);
  for (const auto& [bgr, name] : {std::pair{grey, "grey"},
                                  {dark, "dark"},
                                  {bright, "overexposed"},
                                  {blurred, "blurred"},
                                  {warm, "in warm light"},
                                  {compressed, "compressed"}}) {
    expect_same(make(bgr), as_it_is, 6, 8, name);
  }
}

TEST_F(ShippedHeads, AMirroredPhotoShowsTheHeadFromTheOtherSide) {
  const Made as_it_is = make(photo_);
  cv::Mat mirrored;
  cv::flip(photo_, mirrored, 1);
  const float width = float(photo_.cols);
  const Made made = make(mirrored, {width - kHeadBox[2], kHeadBox[1], width - kHeadBox[0], kHeadBox[3]});
  expect_sound(made);
  EXPECT_NEAR(made.yaw_deg(), -as_it_is.yaw_deg(), 8);
  EXPECT_NEAR(made.pitch_deg(), as_it_is.pitch_deg(), 8);
}

TEST_F(ShippedHeads, RotatedPhotosShowTheSameHeadWhereTheirRollIsTold) {
  const Made as_it_is = make(photo_);
  const cv::Point2f middle(227, 101);  // of the head
  for (const double roll_deg : {-120.0, -35.0, 20.0, 90.0, 180.0}) {
    const cv::Mat turn = cv::getRotationMatrix2D(middle, -roll_deg, 1);
    cv::Mat turned;
    cv::warpAffine(photo_, turned, turn, photo_.size(), cv::INTER_LINEAR, cv::BORDER_REPLICATE);
    const float half = 0.5f * (kHeadBox[3] - kHeadBox[1]);
    const Box box = {middle.x - half, middle.y - half, middle.x + half, middle.y + half};
    const std::string name = "turned by " + std::to_string(roll_deg) + " degrees";
    expect_same(make(turned, box, roll_deg / kDegrees), as_it_is, 4, 12, name.c_str());
    if (const auto untold = head_or_status(turned, box)) expect_sound(*untold);
  }
}

TEST_F(ShippedHeads, FacesOf64And2000PixelsShowTheSameHeadAndOneOf32AHeadOrAStatus) {
  const Made as_it_is = make(photo_);
  const auto scaled = [&](double face_px) {
    const double scale = face_px / (kHeadBox[3] - kHeadBox[1]);
    cv::Mat made;
    cv::resize(photo_, made, {}, scale, scale, scale < 1 ? cv::INTER_AREA : cv::INTER_CUBIC);
    Box box;
    for (size_t side = 0; side < 4; ++side) box[side] = float(scale * kHeadBox[side]);
    return std::pair{made, box};
  };
  for (const double face_px : {64.0, 2000.0}) {
    const auto& [bgr, box] = scaled(face_px);
    expect_same(make(bgr, box), as_it_is, 4, 10, face_px < 100 ? "64 px" : "2000 px");
  }
  const auto& [tiny, box] = scaled(32);
  if (const auto made = head_or_status(tiny, box)) expect_sound(*made);
}

TEST_F(ShippedHeads, WhatIsCoveredIsFilledInByThePrior) {
  const Made as_it_is = make(photo_);
  const cv::Scalar cloth(150, 110, 60), black(10, 10, 10), skin(120, 150, 200);
  const auto with = [&](const cv::Rect& covered, const cv::Scalar& bgr) {
    cv::Mat made = photo_.clone();
    made(covered).setTo(bgr);
    return made;
  };
  expect_same(make(with({195, 92, 72, 22}, black)), as_it_is, 8, 15, "dark glasses");
  expect_same(make(with({190, 128, 80, 60}, cloth)), as_it_is, 8, 15, "a mask");
  cv::Mat hand = photo_.clone();
  cv::ellipse(hand, {215, 165}, {22, 38}, 20, 0, 360, skin, cv::FILLED);
  expect_same(make(hand), as_it_is, 8, 15, "a hand");
  const auto half = head_or_status(with({228, 0, 120, 200}, cloth), kHeadBox);
  if (half) expect_sound(*half);
}

TEST_F(ShippedHeads, PicturesWithoutAHeadAreAStatus) {
  const auto of = [](int width, int height, const cv::Scalar& bgr) { return cv::Mat(height, width, CV_8UC3, bgr); };
  cv::Mat noise(240, 320, CV_8UC3), checkers(240, 320, CV_8UC3), ramp(240, 320, CV_8UC3);
  cv::RNG(7).fill(noise, cv::RNG::UNIFORM, 0, 256);
  for (int y = 0; y < 240; ++y) {
    for (int x = 0; x < 320; ++x) {
      checkers.at<cv::Vec3b>(y, x) = (x + y) % 2 != 0 ? cv::Vec3b(255, 255, 255) : cv::Vec3b(0, 0, 0);
      ramp.at<cv::Vec3b>(y, x) = cv::Vec3b(uint8_t(x / 2), uint8_t(y), uint8_t((x + y) / 3));
    }
  }
  const cv::Mat flag = photo_(cv::Rect(0, 0, 120, 220)).clone(), shuttle = photo_(cv::Rect(350, 0, 160, 290)).clone();
  for (const auto& [bgr, name] : {std::pair{of(320, 240, {0, 0, 0}), "black"},
                                  {of(320, 240, {255, 255, 255}), "white"},
                                  {noise, "noise"},
                                  {checkers, "checkers"},
                                  {ramp, "a ramp"},
                                  {flag, "a flag"},
                                  {shuttle, "a rocket"},
                                  {of(1, 1, {9, 9, 9}), "a dot"},
                                  {of(4000, 1, {90, 90, 90}), "a line"}}) {
    EXPECT_FALSE(head_or_status(bgr)) << name;
  }
}

TEST_F(ShippedHeads, CatsStatuesAndDrawingsAreAHeadOrAStatus) {
  cv::Mat cat(300, 300, CV_8UC3, cv::Scalar(200, 220, 210));
  const cv::Scalar fur(60, 110, 170), dark(20, 20, 30), pink(150, 130, 230);
  cv::circle(cat, {150, 160}, 90, fur, cv::FILLED, cv::LINE_AA);
  for (const int side : {-1, 1}) {
    const std::vector<cv::Point> ear = {{150 + side * 85, 120}, {150 + side * 80, 30}, {150 + side * 20, 80}};
    cv::fillConvexPoly(cat, ear, fur, cv::LINE_AA);
    cv::ellipse(cat, {150 + side * 38, 145}, {14, 20}, 0, 0, 360, cv::Scalar(90, 230, 200), cv::FILLED, cv::LINE_AA);
    cv::ellipse(cat, {150 + side * 38, 145}, {4, 18}, 0, 0, 360, dark, cv::FILLED, cv::LINE_AA);
    for (int k = -1; k <= 1; ++k) cv::line(cat, {150 + side * 20, 195}, {150 + side * 110, 190 + 15 * k}, dark, 1);
  }
  cv::circle(cat, {150, 180}, 8, pink, cv::FILLED, cv::LINE_AA);

  cv::Mat drawing(300, 300, CV_8UC3, cv::Scalar(255, 255, 255));
  cv::ellipse(drawing, {150, 150}, {80, 105}, 0, 0, 360, dark, 2, cv::LINE_AA);
  for (const int side : {-1, 1}) cv::circle(drawing, {150 + 32 * side, 130}, 8, dark, 2, cv::LINE_AA);
  cv::line(drawing, {150, 140}, {140, 175}, dark, 2, cv::LINE_AA);
  cv::ellipse(drawing, {150, 195}, {35, 15}, 0, 0, 180, dark, 2, cv::LINE_AA);

  cv::Mat statue, edges;  // a face of one material, and one in lines
  cv::cvtColor(photo_, statue, cv::COLOR_BGR2GRAY);
  cv::bilateralFilter(statue, edges, 9, 60, 9);
  edges.convertTo(statue, -1, 0.6, 90);
  cv::Canny(edges, edges, 40, 100);
  cv::bitwise_not(edges, edges);
  cv::cvtColor(statue, statue, cv::COLOR_GRAY2BGR);
  cv::cvtColor(edges, edges, cv::COLOR_GRAY2BGR);
  for (const cv::Mat* bgr : {&cat, &drawing, &statue, &edges}) {
    if (const auto made = head_or_status(*bgr)) expect_sound(*made);
    const float side = float(bgr->cols);
    const Box box = side == 300 ? Box{50, 30, 250, 260} : kHeadBox;
    if (const auto made = head_or_status(*bgr, box)) expect_sound(*made);
  }
}

TEST_F(ShippedHeads, AHeadThatNobodyPointedAtIsFound) {
  const Made pointed = make(photo_);
  const auto found = head_or_status(photo_);
  ASSERT_TRUE(found);
  expect_same(*found, pointed, 4, 10, "without a box");
}

}  // namespace
}  // namespace shipped_heads
