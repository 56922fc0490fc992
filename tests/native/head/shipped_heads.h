// The shipped encoder and prior, and a photo of a person.
#pragma once

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/error.h"
#include "head/reconstruction/head_builder.h"
#include "head/reconstruction/head_surface.h"
#include "support/samples/tiny_head.h"

namespace shipped_heads {

using namespace maq::head;  // NOLINT
using maq::length;
using maq::Vec3;
using Box = std::array<float, 4>;

inline constexpr Box kHeadBox = {152, 12, 302, 190};  // of tests/media/photo.jpg
inline constexpr double kDegrees = 180 / 3.14159265358979323846;

inline cv::Mat read_photo() { return cv::imread(MAQ_TEST_MEDIA "/photo.jpg"); }

// One head, without time for the fit to the pixels: its shape and its camera are settled before.
struct Made {
  StoredHead head;
  PhotoFound found;

  // How far the camera is to the person's left of straight before the face, and how far above it.
  double yaw_deg() const { return std::atan2(eye().x, -eye().y) * kDegrees; }
  double pitch_deg() const { return std::asin(eye().z / length(eye())) * kDegrees; }
  Vec3 eye() const { return inverse(head.cameras.at(0).head_to_camera) * Vec3{}; }
};

class ShippedHeads : public testing::Test {
 protected:
  static HeadBuilder& builder() {
    static HeadBuilder made(tiny_head::runtime(), maq::read_bundle(MAQ_TEST_MODELS "/heads-int8"), settings());
    return made;
  }
  static maq::SessionSettings settings() {
    maq::SessionSettings made;
    return made;
  }

  static void add(const cv::Mat& bgr, const Box& box, double roll_rad = 0) {
    PhotoHints hints;
    hints.box_px = box, hints.roll_rad = roll_rad;
    builder().add_photo(maq::packed_view(MAQ_PIXEL_BGR8, bgr.cols, bgr.rows, bgr.data), hints);
  }
  static Made make(const cv::Mat& bgr, const Box& box = kHeadBox, double roll_rad = 0) {
    builder().clear();
    add(bgr, box, roll_rad);
    return {builder().fit(0, nullptr), builder().found(0)};
  }
  // Nothing where it was said that no head is seen, or none that can be fitted.
  static std::optional<Made> head_or_status(const cv::Mat& bgr, const Box& box = {}, double roll_rad = 0) {
    try {
      return make(bgr, box, roll_rad);
    } catch (const maq::Error& error) {
      EXPECT_EQ(error.status(), MAQ_ERROR_NOT_FOUND) << error.what();
      EXPECT_EQ(std::string(error.what()).back(), '.') << error.what();
      return std::nullopt;
    }
  }
  // Mean distance of the places that the prior knows on both heads.
  static double mm_between(const Made& a, const Made& b) {
    const std::vector<float>&p = a.head.anchors.points, &q = b.head.anchors.points;
    double sum = 0;
    for (size_t i = 0; i + 2 < p.size(); i += 3)
      sum += std::hypot(p[i] - q[i], p[i + 1] - q[i + 1], p[i + 2] - q[i + 2]);
    return 100 * sum / double(p.size() / 3);
  }
  static void expect_sound(const Made& made) {
    for (const float number : made.head.anchors.points) ASSERT_TRUE(std::isfinite(number));
    EXPECT_EQ(stored_head_fault(made.head), "");
    EXPECT_GT(find_head_landmark(made.head, "pupil_left").point.x, 0.1) << "left is the person's";
    EXPECT_LT(find_head_landmark(made.head, "nose_tip").point.y, -0.6) << "the face looks to -y";
  }
  static void expect_same(const Made& made, const Made& as, double mm, double degrees, const char* what) {
    expect_sound(made);
    EXPECT_LT(mm_between(made, as), mm) << what;
    EXPECT_NEAR(made.yaw_deg(), as.yaw_deg(), degrees) << what;
    EXPECT_NEAR(made.pitch_deg(), as.pitch_deg(), degrees) << what;
  }

  const cv::Mat photo_ = read_photo();
};

}  // namespace shipped_heads
