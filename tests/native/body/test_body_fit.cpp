// The fit of a body: derivatives, known poses, and input that shows too little.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "body/fit/body_fitter.h"
#include "support/samples/shipped_body.h"

namespace body_fit {
namespace {

using namespace maq::body;  // NOLINT
using maq::Vec3;
using shipped_body::drawn_pose;
using shipped_body::keypoint_distance_m;
using shipped_body::model;

const BodyCamera kPinhole = {true, 600, 600, 320, 240};

// Exact pixels of points all over the surface; `keep` says of a part whether it is seen.
template <class Keep>
Observations observe(const BodyCamera& camera, const BodyPose& pose, uint32_t seed, Keep&& keep) {
  std::mt19937 random(seed);
  const BodyBones bones = bones_of(model(), pose);
  Observations seen;
  while (seen.points.size() < 220) {
    Observation observation;
    observation.part = uint8_t(1 + random() % 24);
    if (!keep(observation.part)) continue;
    observation.point = shipped_body::seen_point(model(), observation.part, int(random() % 256), int(random() % 256));
    if (observation.point.joint_count == 0) continue;
    observation.at = project(camera, pose.place, shipped_body::place_point(model(), bones, observation.point)).at;
    seen.points.push_back(observation);
  }
  seen.surface_count = seen.points.size();
  seen.size_px = 0.7 * scale_at(camera, pose.place);
  return seen;
}

Observations observe_all(const BodyCamera& camera, const BodyPose& pose, uint32_t seed) {
  return observe(camera, pose, seed, [](int) { return true; });
}

FitSettings exact_settings() {
  FitSettings settings;
  settings.error_of_size = 0.001;
  settings.independent_points = 1e4;
  settings.iterations = 60;
  return settings;
}

TEST(BodyFit, RowsOfAPointAreThoseOfFiniteDifferences) {
  const BodyPose pose = [] {
    BodyPose drawn = drawn_pose(3, 1, 0.7);
    drawn.rotation[6] = {2.4, -1.9, 0.6};  // beyond pi
    drawn.place = {0.2, -0.1, 3};
    return drawn;
  }();
  for (const BodyCamera& camera : {kPinhole, BodyCamera{}}) {
    FitProblem problem;
    problem.camera = camera;
    BodyPose at = pose;
    if (!camera.is_perspective) at.place = {300, 200, 5};
    const Observations seen = observe_all(camera, at, 4);
    problem.seen = &seen;
    FitEquations equations(model());
    for (size_t i = 0; i < 40; ++i) {
      equations.linearize(problem, at);
      PointRows rows;
      equations.rows_of(problem, at, seen.points[i].point, rows);
      std::array<double, kMaxUnknowns> x{}, y{};
      for (size_t k = 0; k < rows.count; ++k) x[rows.unknown[k]] = rows.x[k], y[rows.unknown[k]] = rows.y[k];
      for (size_t k = 0; k < unknown_count(model()); ++k) {
        constexpr double kDelta = 1e-6;
        const auto seen_after = [&](double change) {
          std::array<double, kMaxUnknowns> step{};
          step[k] = change;
          const BodyPose moved = stepped(model(), at, step.data(), 10);
          return project(camera, moved.place,
                         shipped_body::place_point(model(), bones_of(model(), moved), seen.points[i].point));
        };
        const Projection more = seen_after(kDelta), less = seen_after(-kDelta);
        EXPECT_NEAR(x[k], (more.at.x - less.at.x) / (2 * kDelta), 1e-4 * (1 + std::abs(x[k]))) << k;
        EXPECT_NEAR(y[k], (more.at.y - less.at.y) / (2 * kDelta), 1e-4 * (1 + std::abs(y[k]))) << k;
      }
    }
  }
}

TEST(BodyFit, TheGradientIsThatOfTheCostWithAllItsTerms) {
  BodyPose pose = drawn_pose(8, 1, 2.0), before = drawn_pose(9, 0.5, 2.0);
  pose.place = {0.1, 0.2, 2.5};
  pose.rotation[8] = {-2.9, 1.5, 0.2};  // beyond its limits
  BodyPose truth = drawn_pose(10, 0.7, 2.1);
  truth.place = {0.12, 0.2, 2.6};
  const Observations seen = observe_all(kPinhole, truth, 5);
  FitProblem problem;
  problem.seen = &seen;
  problem.camera = kPinhole;
  problem.error_px = 6;
  problem.shape.mean[1] = 0.4, problem.shape.precision = 3, problem.shape.height_m = 1.7;
  problem.before = &before, problem.before_precision = 40;
  FitEquations equations(model());
  const double cost = equations.linearize(problem, pose);
  EXPECT_NEAR(cost, equations.cost(problem, pose), 1e-9 * cost);
  equations.linearize(problem, pose);
  const auto gradient = equations.gradient();
  for (size_t k = 0; k < unknown_count(model()); ++k) {
    constexpr double kDelta = 1e-5;
    std::array<double, kMaxUnknowns> step{};
    step[k] = kDelta;
    const double more = equations.cost(problem, stepped(model(), pose, step.data(), 10));
    step[k] = -kDelta;
    const double less = equations.cost(problem, stepped(model(), pose, step.data(), 10));
    EXPECT_NEAR(2 * gradient[k], (more - less) / (2 * kDelta), 1e-3 * (1 + std::abs(gradient[k]))) << k;
  }
}

TEST(BodyFit, FindsAKnownPoseFromExactPoints) {
  BodyFitter fitter(model(), exact_settings());
  for (const uint32_t seed : {1u, 2u, 3u, 4u, 5u, 6u}) {
    BodyPose truth = drawn_pose(seed, 0.8, 1.1 * seed);
    truth.place = {0.3, -0.1, 3};
    const Observations seen = observe_all(kPinhole, truth, seed + 100);
    const FittedBody body = fitter.fit(seen, kPinhole, nullptr, {});
    ASSERT_EQ(body.status, FitStatus::kFitted) << seed;
    EXPECT_LT(keypoint_distance_m(body.pose, truth), 0.005) << seed;
    EXPECT_LT(body.error_px, 0.5) << seed;
  }
}

TEST(BodyFit, FindsKnownPosesOfPeopleWhoLieOrAreUpsideDownOrSeenFromBehind) {
  BodyFitter fitter(model(), exact_settings());
  for (const double roll : {1.57, -1.57, 3.14159265358979}) {
    BodyPose truth = drawn_pose(7, 0.5, 2.6);
    truth.orientation = maq::exp_rotation({0, 0, roll}) * truth.orientation;
    truth.place = {0.3, -0.1, 3};
    const FittedBody body = fitter.fit(observe_all(kPinhole, truth, 9), kPinhole, nullptr, {});
    ASSERT_EQ(body.status, FitStatus::kFitted) << roll;
    EXPECT_LT(keypoint_distance_m(body.pose, truth), 0.005) << roll;
  }
}

TEST(BodyFit, WithoutIntrinsicsFindsThePoseOfADistantPerson) {
  const BodyCamera distant = {true, 30'000, 30'000, 320, 240}, weak;
  BodyFitter fitter(model(), exact_settings());
  BodyPose truth = drawn_pose(12, 0.6, 0.4);
  truth.shape = {};
  truth.place = {0, 0, 120};
  const FittedBody body = fitter.fit(observe_all(distant, truth, 3), weak, nullptr, {});
  ASSERT_EQ(body.status, FitStatus::kFitted);
  EXPECT_LT(keypoint_distance_m(body.pose, truth), 0.02);
  EXPECT_NEAR(scale_at(weak, body.pose.place), 250, 5);
}

TEST(BodyFit, AWarmStartTakesFewerIterationsAndFindsTheSame) {
  BodyFitter fitter(model());
  BodyPose truth = drawn_pose(2, 0.7, 0.5);
  truth.place = {0, 0, 3};
  const FittedBody cold = fitter.fit(observe_all(kPinhole, truth, 1), kPinhole, nullptr, {});
  truth.rotation[7].x += 0.1, truth.place.x += 0.05;
  const Observations next = observe_all(kPinhole, truth, 2);
  const FittedBody warm = fitter.fit(next, kPinhole, &cold.pose, {});
  ASSERT_EQ(warm.status, FitStatus::kFitted);
  EXPECT_LE(warm.iterations, 8);
  EXPECT_LT(warm.iterations, cold.iterations);
  EXPECT_LT(keypoint_distance_m(warm.pose, truth), 0.05);
}

TEST(BodyFit, AStartFarAwayFallsBackToAColdOne) {
  BodyFitter fitter(model());
  BodyPose truth = drawn_pose(2, 0.7, 0.5), before = drawn_pose(4, 0.7, 3.6);
  truth.place = {0, 0, 3};
  before.place = {-1, 0.5, 6};
  const FittedBody body = fitter.fit(observe_all(kPinhole, truth, 1), kPinhole, &before, {});
  ASSERT_EQ(body.status, FitStatus::kFitted);
  EXPECT_LT(keypoint_distance_m(body.pose, truth), 0.08);
}

TEST(BodyFit, JointsThatAreNotSeenStayNearThePrior) {
  const auto is_upper = [](int part) { return part <= 4 || part >= 15; };
  BodyFitter fitter(model());
  BodyPose truth = drawn_pose(5, 0.6, 0.2);
  truth.place = {0, 0, 2};
  const FittedBody body = fitter.fit(observe(kPinhole, truth, 6, is_upper), kPinhole, nullptr, {});
  ASSERT_EQ(body.status, FitStatus::kFitted);
  const BodyPose mean = mean_pose(model());
  for (const char* name : {"lower_leg.L", "lower_leg.R", "foot.L", "foot.R"}) {
    const auto joint = size_t(model().find_joint(name));
    EXPECT_LT(length(body.pose.rotation[joint] - mean.rotation[joint]), 0.5) << name;
    EXPECT_EQ(body.seen_joints >> joint & 1u, 0u) << name;
  }
  EXPECT_EQ(body.seen_joints >> size_t(model().find_joint("lower_arm.L")) & 1u, 1u);
}

TEST(BodyFit, TooFewPointsAreAStatusAndTheMeanPose) {
  BodyFitter fitter(model());
  BodyPose truth = drawn_pose(5, 0.6, 0.2);
  truth.place = {0, 0, 2};
  Observations seen = observe_all(kPinhole, truth, 6);
  seen.points.resize(10);
  seen.surface_count = 10;
  EXPECT_EQ(fitter.fit(seen, kPinhole, nullptr, {}).status, FitStatus::kTooFewPixels);
  seen = {};
  const FittedBody none = fitter.fit(seen, kPinhole, nullptr, {});
  EXPECT_EQ(none.status, FitStatus::kTooFewPixels);
  EXPECT_EQ(keypoint_distance_m(none.pose, mean_pose(model())), 0);
}

TEST(BodyFit, PixelsThatAreNonsenseAreAStatusNotAWildMesh) {
  BodyFitter fitter(model());
  std::mt19937 random(3);
  BodyPose truth = drawn_pose(5, 0.6, 0.2);
  truth.place = {0, 0, 2};
  const Observations right = observe_all(kPinhole, truth, 6);
  const auto expect_sane = [&](const Observations& seen, const char* what) {
    for (const BodyCamera& camera : {kPinhole, BodyCamera{}}) {
      const FittedBody body = fitter.fit(seen, camera, nullptr, {});
      EXPECT_TRUE(is_finite(body.pose, model().joints.size())) << what;
      for (const double shape : body.pose.shape) EXPECT_LE(std::abs(shape), 3) << what;
      for (const BodyPoint& point : model().keypoints) {
        EXPECT_LT(length(posed(model(), bones_of(model(), body.pose), point)), 2) << what;
      }
    }
  };
  Observations seen = right;
  for (Observation& observation : seen.points) observation.at = {100, 100};
  expect_sane(seen, "all in one place");
  for (Observation& observation : seen.points) observation.at.x = double(random() % 640);
  expect_sane(seen, "on a line");
  for (Observation& observation : seen.points) observation.at = {double(random() % 640), double(random() % 480)};
  expect_sane(seen, "anywhere");
  EXPECT_NE(fitter.fit(seen, kPinhole, nullptr, {}).status, FitStatus::kFitted);
  for (Observation& observation : seen.points) observation.at.x = std::numeric_limits<double>::quiet_NaN();
  expect_sane(seen, "NaN");
  EXPECT_EQ(fitter.fit(seen, kPinhole, nullptr, {}).status, FitStatus::kUnreliable);
  seen = right;
  for (Observation& observation : seen.points) observation.point = right.points[0].point;
  expect_sane(seen, "one point of the surface");
  seen = right;
  for (Observation& observation : seen.points) observation.at.x = 640 - observation.at.x;
  expect_sane(seen, "mirrored");
  seen = right;
  for (Observation& observation : seen.points) observation.at.y = 5 * observation.at.y;
  expect_sane(seen, "five times as tall");
}

TEST(BodyFit, ShapesAtTheirBoundsAndPosesThatAreNoNumbersAreHandled) {
  BodyFitter fitter(model());
  BodyPose truth = drawn_pose(5, 0.3, 0.2), before = truth;
  truth.shape.fill(4);
  truth.place = {0, 0, 3};
  const FittedBody body = fitter.fit(observe_all(kPinhole, truth, 6), kPinhole, nullptr, {});
  ASSERT_EQ(body.status, FitStatus::kFitted);
  for (const double shape : body.pose.shape) EXPECT_LE(std::abs(shape), 3);
  before.rotation[3].x = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(fitter.fit(observe_all(kPinhole, truth, 6), kPinhole, &before, {}).status, FitStatus::kFitted);
}

}  // namespace
}  // namespace body_fit
