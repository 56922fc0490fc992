// The shipped networks on images of a head whose shape, camera and face are known: from every side, with an open
// mouth and closed eyes; and on many people.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "head/reconstruction/registered_template.h"
#include "head/render/head_renderer.h"
#include "head/shipped_heads.h"

namespace shipped_heads {
namespace {

constexpr int kSide_px = 320;

// An image of a head before a plain wall, and where the head is in it.
struct View {
  cv::Mat bgr;
  Box box;
};

class ShippedHeadViews : public ShippedHeads {
 protected:
  static View view_of(const HeadMesh& mesh, double yaw_deg, double pitch_deg) {
    HeadRenderOptions options;
    options.background_rgb = {96, 110, 118};
    HeadRenderer renderer(mesh, std::nullopt, options);
    maq::RenderedImage picture;
    renderer.render(renderer.orbit_camera(yaw_deg / kDegrees, pitch_deg / kDegrees, kSide_px, kSide_px), picture);
    const cv::Mat bgr(kSide_px, kSide_px, CV_8UC3, picture.bgr.data());
    const cv::Rect seen = cv::boundingRect(cv::Mat(kSide_px, kSide_px, CV_8U, picture.alpha.data()));
    return {bgr.clone(), {float(seen.x), float(seen.y), float(seen.br().x), float(seen.br().y)}};
  }

  maq::WorkerThreads threads_{1};
};

TEST_F(ShippedHeadViews, FromEverySideThereIsAHeadThatStaysAHeadOrAStatus) {
  const HeadMesh mesh = head_surface(make(photo_).head, {0.003}, threads_);
  const View front = view_of(mesh, 0, 0);
  const Made straight = make(front.bgr, front.box);
  for (const auto& [yaw_deg, pitch_deg] : {std::pair{0.0, 0.0},
                                           {-40.0, 0.0},
                                           {40.0, 15.0},
                                           {75.0, 0.0},
                                           {-90.0, 0.0},
                                           {135.0, 0.0},
                                           {180.0, 0.0},
                                           {0.0, 60.0},
                                           {0.0, 85.0},
                                           {0.0, -45.0}}) {
    const std::string name = "from " + std::to_string(yaw_deg) + ", " + std::to_string(pitch_deg);
    const View view = view_of(mesh, yaw_deg, pitch_deg);
    const auto made = head_or_status(view.bgr, view.box);
    if (std::abs(yaw_deg) <= 40 && std::abs(pitch_deg) <= 15) {
      ASSERT_TRUE(made) << name;
      EXPECT_NEAR(made->yaw_deg(), yaw_deg, 12) << name;
      EXPECT_NEAR(made->pitch_deg(), pitch_deg, 12) << name;
      EXPECT_LT(mm_between(*made, straight), 8) << name;
    }
    if (!made) continue;
    expect_sound(*made);
    // Unseen parts follow the prior: no code runs away.
    for (const float code : made->head.codes.shape) EXPECT_LT(std::abs(code), 4) << name;
  }
}

TEST_F(ShippedHeadViews, AnOpenMouthAndClosedEyesAreTheSamePerson) {
  const Made as_it_is = make(photo_);
  HeadMesh mesh = registered_template(as_it_is.head,
                                      *template_of_bundle(maq::read_bundle(MAQ_TEST_MODELS "/heads-int8")), threads_);
  const View still = view_of(mesh, 10, 0);
  for (const MorphTarget& target : mesh.morph_targets) {
    if (target.name != "jawOpen" && target.name.rfind("eyeBlink", 0) != 0) continue;
    for (size_t i = 0; i < target.vertices.size(); ++i) {
      for (size_t axis = 0; axis < 3; ++axis) {
        mesh.positions[3 * target.vertices[i] + axis] += target.deltas[3 * i + axis];
      }
    }
  }
  const View moved = view_of(mesh, 10, 0);
  EXPECT_GT(cv::norm(still.bgr, moved.bgr, cv::NORM_INF), 30) << "the mouth is open";
  const Made before = make(still.bgr, still.box);
  expect_same(make(moved.bgr, moved.box), before, 8, 15, "with an open mouth and closed eyes");
}

TEST_F(ShippedHeadViews, TwentyPeopleInAPhotoAreTwentyHeads) {
  const Made alone = make(photo_);
  const cv::Rect part(100, 0, 250, 240);  // of the photo, with the head
  cv::Mat crowd(4 * part.height, 5 * part.width, CV_8UC3);
  for (int i = 0; i < 20; ++i) {
    const int x = i % 5 * part.width, y = i / 5 * part.height;
    photo_(part).copyTo(crowd({x, y, part.width, part.height}));
  }
  for (int i = 0; i < 20; ++i) {
    const float x = float(i % 5 * part.width - part.x), y = float(i / 5 * part.height - part.y);
    const Made made = make(crowd, {kHeadBox[0] + x, kHeadBox[1] + y, kHeadBox[2] + x, kHeadBox[3] + y});
    // The camera looks past most of them, so that their heads are turned a little.
    expect_sound(made);
    EXPECT_LT(mm_between(made, alone), 6) << i;
    EXPECT_EQ(made.head.cameras.size(), 1u) << i;
  }
}

}  // namespace
}  // namespace shipped_heads
