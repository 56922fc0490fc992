// Bodies of people in dense pose images: ids, warm starts, and images that show little or nonsense.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "body/fit/people_fitter.h"
#include "support/samples/shipped_body.h"

namespace people_fitter {
namespace {

using namespace maq::body;  // NOLINT
using shipped_body::drawn_pose;
using shipped_body::keypoint_distance_m;
using shipped_body::model;
using shipped_body::Picture;

const BodyCamera kPinhole = {true, 500, 500, 159.5, 119.5};
constexpr int kWidth = 320, kHeight = 240;
constexpr int64_t kFrame_ns = 33'000'000;

BodyPose person_at(uint32_t seed, double x_m, double z_m) {
  BodyPose pose = drawn_pose(seed, 0.5, 0.4);
  pose.place = {x_m, 0.1, z_m};
  return pose;
}

TEST(PeopleFitter, FindsTwoPeopleInAnImage) {
  const BodyPose a = person_at(1, -0.6, 4.2), b = person_at(2, 0.6, 4.5);
  Picture picture(kWidth, kHeight);
  picture.paint(kPinhole, a, 1);
  picture.paint(kPinhole, b, 2);
  PeopleFitter fitter(model());
  fitter.begin_frame(picture.labels(), kPinhole, 0);
  const FittedBody found_a = fitter.fit({1, 7, nullptr}), found_b = fitter.fit({2, 8, nullptr});
  ASSERT_EQ(found_a.status, FitStatus::kFitted);
  ASSERT_EQ(found_b.status, FitStatus::kFitted);
  EXPECT_LT(keypoint_distance_m(found_a.pose, a), 0.06);
  EXPECT_LT(keypoint_distance_m(found_b.pose, b), 0.06);
  EXPECT_LT(length(found_a.pose.place - a.place), 0.3);
}

TEST(PeopleFitter, AnIdStartsFromTheFrameBeforeUnlessTimeGoesBackOrASecondPasses) {
  const BodyPose pose = person_at(3, 0, 4.2);
  Picture picture(kWidth, kHeight);
  picture.paint(kPinhole, pose, 1);
  PeopleFitter fitter(model());
  const auto iterations_at = [&](int64_t time_ns) {
    fitter.begin_frame(picture.labels(), kPinhole, time_ns);
    return fitter.fit({1, 5, nullptr}).iterations;
  };
  const int cold = iterations_at(10 * kFrame_ns);
  EXPECT_GT(cold, 8);
  EXPECT_LE(iterations_at(11 * kFrame_ns), 8);
  EXPECT_GT(iterations_at(9 * kFrame_ns), 8);                  // back
  EXPECT_GT(iterations_at(2'000'000'000 + 9 * kFrame_ns), 8);  // two seconds later
  EXPECT_LE(iterations_at(2'000'000'000 + 10 * kFrame_ns), 8);
  fitter.reset();
  EXPECT_GT(iterations_at(2'000'000'000 + 11 * kFrame_ns), 8);
  fitter.begin_frame(picture.labels(), {}, 2'000'000'000 + 12 * kFrame_ns);  // another kind of camera
  EXPECT_GT(fitter.fit({1, 5, nullptr}).iterations, 8);
}

TEST(PeopleFitter, AShapeSettlesOverTheFrames) {
  BodyPose pose = person_at(4, 0, 4.2);
  PeopleFitter fitter(model());
  std::array<double, kMaxShapes> before{};
  double late_change = 0;
  for (int frame = 0; frame < 12; ++frame) {
    pose.orientation = kFacing * maq::exp_rotation({0, 0, 0.05 * frame});
    Picture picture(kWidth, kHeight);
    picture.paint(kPinhole, pose, 1);
    fitter.begin_frame(picture.labels(), kPinhole, frame * kFrame_ns);
    const FittedBody body = fitter.fit({1, 5, nullptr});
    ASSERT_EQ(body.status, FitStatus::kFitted);
    if (frame > 8) {
      for (size_t s = 0; s < kMaxShapes; ++s) {
        late_change = std::max(late_change, std::abs(body.pose.shape[s] - before[s]));
      }
    }
    before = body.pose.shape;
  }
  EXPECT_LT(late_change, 0.35);
}

TEST(PeopleFitter, APersonCutByTheBorderKeepsUnseenJointsSane) {
  BodyPose pose = person_at(5, 0, 2.0);
  pose.place.y = 0.9;  // hips and legs are below the image
  Picture picture(kWidth, kHeight);
  picture.paint(kPinhole, pose, 1);
  PeopleFitter fitter(model());
  fitter.begin_frame(picture.labels(), kPinhole, 0);
  const FittedBody body = fitter.fit({1, 0, nullptr});
  ASSERT_EQ(body.status, FitStatus::kFitted);
  for (const char* name : {"foot.L", "foot.R"}) {
    EXPECT_EQ(body.seen_joints >> size_t(model().find_joint(name)) & 1u, 0u) << name;
  }
  for (size_t k = 0; k < model().angle_count(); ++k) {
    const maq::Vec3 v = body.pose.rotation[1 + k / 3];
    const double angle = k % 3 == 0 ? v.x : k % 3 == 1 ? v.y : v.z;
    EXPECT_GT(angle, model().prior.low[k] - 0.3) << k;
    EXPECT_LT(angle, model().prior.high[k] + 0.3) << k;
  }
}

TEST(PeopleFitter, NobodyAFewPixelsAndNumbersWithoutPixelsAreAStatus) {
  Picture picture(kWidth, kHeight);
  PeopleFitter fitter(model());
  fitter.begin_frame(picture.labels(), kPinhole, 0);
  EXPECT_EQ(fitter.fit({1, 1, nullptr}).status, FitStatus::kTooFewPixels);
  picture.part[5] = 2, picture.person[5] = 1;
  fitter.begin_frame(picture.labels(), kPinhole, 1);
  EXPECT_EQ(fitter.fit({1, 1, nullptr}).status, FitStatus::kTooFewPixels);
  EXPECT_EQ(fitter.fit({200, 1, nullptr}).status, FitStatus::kTooFewPixels);
  const LabelImage none{1, 1, picture.part.data(), picture.u.data(), picture.v.data(), nullptr, 1};
  fitter.begin_frame(none, {}, 2);
  EXPECT_EQ(fitter.fit({1, 1, nullptr}).status, FitStatus::kTooFewPixels);
}

TEST(PeopleFitter, PlanesOfNoiseAndOfOneLabelGiveNoWildBody) {
  std::mt19937 random(4);
  PeopleFitter fitter(model());
  for (int kind = 0; kind < 30; ++kind) {
    Picture picture(kWidth, kHeight);
    for (size_t i = 0; i < picture.part.size(); ++i) {
      picture.part[i] = uint8_t(kind < 24 ? kind + 1 : random() % 256);
      picture.u[i] = uint8_t(kind < 24 ? 128 : random());
      picture.v[i] = uint8_t(kind < 24 ? 128 : random());
      picture.person[i] = 1;
    }
    for (const BodyCamera& camera : {kPinhole, BodyCamera{}}) {
      fitter.begin_frame(picture.labels(), camera, kind);
      const FittedBody body = fitter.fit({1, 1, nullptr});
      ASSERT_TRUE(is_finite(body.pose, model().joints.size())) << kind;
      for (const BodyPoint& point : model().keypoints) {
        EXPECT_LT(length(posed(model(), bones_of(model(), body.pose), point)), 2) << kind;
      }
      for (const double shape : body.pose.shape) EXPECT_LE(std::abs(shape), 3) << kind;
    }
  }
}

TEST(PeopleFitter, KeypointsThatAreNoNumbersOrUnsureAreLeftOut) {
  const BodyPose pose = person_at(6, 0, 4.2);
  Picture picture(kWidth, kHeight);
  picture.paint(kPinhole, pose, 1);
  std::vector<float> keypoints(99, std::numeric_limits<float>::quiet_NaN());
  for (size_t k = 0; k < 33; k += 2) keypoints[3 * k] = keypoints[3 * k + 1] = -1e30f, keypoints[3 * k + 2] = 0.1f;
  PeopleFitter with(model()), without(model());
  with.begin_frame(picture.labels(), kPinhole, 0);
  without.begin_frame(picture.labels(), kPinhole, 0);
  const FittedBody a = with.fit({1, 0, keypoints.data()}), b = without.fit({1, 0, nullptr});
  EXPECT_EQ(keypoint_distance_m(a.pose, b.pose), 0);
  const BodyBones bones = bones_of(model(), pose);
  for (size_t k = 0; k < 33; ++k) {
    const Pixel at = project(kPinhole, pose.place, posed(model(), bones, model().keypoints[k])).at;
    keypoints[3 * k] = float(at.x + 0.5), keypoints[3 * k + 1] = float(at.y + 0.5), keypoints[3 * k + 2] = 0.9f;
  }
  const FittedBody c = with.fit({1, 0, keypoints.data()});
  EXPECT_LT(keypoint_distance_m(c.pose, pose), keypoint_distance_m(b.pose, pose) + 0.005);
}

TEST(PeopleFitter, ManyIdsKeepMemoryBounded) {
  const BodyPose pose = person_at(6, 0, 4.2);
  Picture picture(kWidth, kHeight);
  picture.paint(kPinhole, pose, 1);
  PeopleFitter fitter(model());
  for (int64_t id = 1; id < 100; ++id) {
    fitter.begin_frame(picture.labels(), kPinhole, id);
    EXPECT_EQ(fitter.fit({1, id, nullptr}).status, FitStatus::kFitted);
  }
  fitter.begin_frame(picture.labels(), kPinhole, 100);
  EXPECT_LE(fitter.fit({1, 99, nullptr}).iterations, 8);
  EXPECT_GT(fitter.fit({1, 1, nullptr}).iterations, 8);  // forgotten: it was seen first
}

}  // namespace
}  // namespace people_fitter
