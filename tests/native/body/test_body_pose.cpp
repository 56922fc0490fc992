// Forward kinematics and skinning against the teachers' body in float64, cameras, and angles of joints.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "body/pose/body_camera.h"
#include "body/pose/joint_angles.h"
#include "support/expect_error.h"
#include "support/samples/shipped_body.h"

namespace body_pose {
namespace {

using namespace maq::body;  // NOLINT
using maq::Mat3;
using maq::Vec3;
using shipped_body::model;

constexpr size_t kStep = 97;  // of the vertices in poses.f64

std::vector<double> read_doubles(const std::string& path) {
  const std::string bytes = read_text(path);
  std::vector<double> values(bytes.size() / sizeof(double));
  std::memcpy(values.data(), bytes.data(), bytes.size());
  return values;
}

TEST(BodyPose, PlacesVerticesAndKeypointsWhereTheTeachersBodyDoes) {
  const BodyModel& body = model();
  const std::vector<double> values = read_doubles(std::string(MAQ_TEST_DATA) + "/tiny_body/poses.f64");
  const size_t shown = (body.vertices.size() + kStep - 1) / kStep + kKeypoints, row = 19 * 3 + 10 + 3 * shown;
  ASSERT_EQ(values.size(), 6 * row);
  for (size_t number = 0; number < 6; ++number) {
    const double* at = values.data() + number * row;
    BodyPose pose;
    for (size_t j = 0; j < 19; ++j, at += 3) pose.rotation[j] = {at[0], at[1], at[2]};
    pose.orientation = maq::exp_rotation(pose.rotation[0]);
    for (size_t s = 0; s < 10; ++s) pose.shape[s] = *at++;
    const BodyBones bones = bones_of(body, pose);
    const auto compare = [&](const BodyPoint& point) {
      const Vec3 found = posed(body, bones, point);
      EXPECT_LT(length(found - Vec3{at[0], at[1], at[2]}), 1e-9) << number;
      at += 3;
    };
    for (size_t i = 0; i < body.vertices.size(); i += kStep) compare(body.vertices[i]);
    for (const BodyPoint& point : body.keypoints) compare(point);
  }
}

TEST(BodyPose, TheLeftJacobianIsThatOfFiniteDifferencesNearZeroAndAtPi) {
  const Vec3 axis = maq::normalized({0.3, -0.5, 0.8});
  for (const double angle : {0.0, 1e-9, 1e-3, 0.04, 0.06, 1.0, 3.14159265358979, 4.0}) {
    const Vec3 w = angle * axis;
    const Mat3 jacobian = maq::left_jacobian(w);
    for (size_t k = 0; k < 3; ++k) {
      constexpr double kDelta = 1e-6;
      Vec3 more = w, less = w;
      (&more.x)[k] += kDelta, (&less.x)[k] -= kDelta;
      const Vec3 turn =
          (0.5 / kDelta) * maq::log_rotation(maq::exp_rotation(more) * transposed(maq::exp_rotation(less)));
      EXPECT_LT(length(turn - Vec3{jacobian[k], jacobian[3 + k], jacobian[6 + k]}), 1e-8) << angle;
    }
  }
}

TEST(BodyPose, AFacingPersonStandsUprightWithTheLeftHandAtTheRightOfTheImage) {
  const BodyBones bones = bones_of(model(), mean_pose(model()));
  const auto at = [&](size_t keypoint) { return posed(model(), bones, model().keypoints[keypoint]); };
  EXPECT_LT(at(0).y, -0.4);             // the nose is above the pelvis
  EXPECT_GT(at(27).y, 0.6);             // the ankle below
  EXPECT_GT(at(15).x, at(16).x + 0.2);  // the left wrist
  EXPECT_LT(at(0).z, at(7).z);          // the nose is nearer than an ear
}

TEST(BodyPose, CamerasAgreeOnADistantBody) {
  const BodyCamera pinhole = {true, 50'000, 50'000, 320, 240}, weak;
  const Vec3 point = {0.3, -0.5, 0.1};
  const Projection a = project(pinhole, place_of(pinhole, {100, 200}, 250), point);
  const Projection b = project(weak, place_of(weak, {100, 200}, 250), point);
  EXPECT_NEAR(a.at.x, b.at.x, 0.1);
  EXPECT_NEAR(a.at.y, b.at.y, 0.1);
  EXPECT_NEAR(scale_at(pinhole, place_of(pinhole, {100, 200}, 250)), 250, 1e-9);
  EXPECT_FALSE(project(pinhole, {0, 0, 0.25}, {0, 0, -0.1}).is_shown);
}

// The axis about which the right elbow bends further, at rest.
Vec3 elbow_axis(const BodyModel& body) {
  const auto at = [&](const char* name) { return body.joints[size_t(body.find_joint(name))].rest; };
  const Vec3 elbow = at("lower_arm.R");
  return maq::normalized(cross(elbow - at("upper_arm.R"), at("hand.R") - elbow));
}

TEST(BodyPose, AnglesAreThoseOfTheRestPoseAndOfJointsThatBend) {
  const BodyModel& body = model();
  const AngleJoints joints(body);
  BodyPose pose;  // all joints at rest
  const auto rest = joints.angles_deg(bones_of(body, pose));
  const auto bent = [&](const char* name, Vec3 axis, double degrees) {
    BodyPose changed = pose;
    changed.rotation[size_t(body.find_joint(name))] = degrees / 57.29577951308232 * axis;
    return joints.angles_deg(bones_of(body, changed));
  };
  for (const size_t elbow : {size_t(0), size_t(1)})
    EXPECT_NEAR(rest[elbow], 41.5, 2);  // at rest the arms are a little bent
  for (size_t k = 2; k < kAngles; ++k) EXPECT_LT(std::abs(rest[k]), 30) << k;
  // A thigh that turns about the axis to the left lifts to the front for negative angles.
  EXPECT_NEAR(bent("upper_leg.R", {1, 0, 0}, -60)[5], rest[5] + 60, 1.5);
  EXPECT_NEAR(bent("upper_leg.R", {1, 0, 0}, -60)[4], rest[4], 1e-9);
  EXPECT_NEAR(bent("lower_leg.L", {1, 0, 0}, 90)[2], 90, 12);
  EXPECT_GT(bent("upper_arm.L", {1, 0, 0}, -80)[6], 60);
  EXPECT_NEAR(bent("lower_arm.R", elbow_axis(body), 60)[1], rest[1] + 60, 1);
  EXPECT_NEAR(bent("lower_arm.R", elbow_axis(body), -41)[1], 0, 2);
}

TEST(BodyPose, ABodyWithoutTheJointsOfAnglesIsRefused) {
  const std::string bytes = read_text(std::string(MAQ_TEST_DATA) + "/tiny_body/body.maqb");
  const BodyModel tiny = read_body(bytes.data(), bytes.size(), "body.maqb");
  expect_error(MAQ_ERROR_BAD_BUNDLE, "has no joint", [&] { AngleJoints joints(tiny); });
}

}  // namespace
}  // namespace body_pose
