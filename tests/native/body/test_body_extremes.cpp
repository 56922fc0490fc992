// Fits of people who are hardly seen, of many people, and of numbers at the edge; solvers against plain references.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "body/fit/people_fitter.h"
#include "body/pose/joint_angles.h"
#include "core/math/small_solve.h"
#include "support/samples/shipped_body.h"

namespace body_extremes {
namespace {

using namespace maq::body;  // NOLINT
using maq::Vec3;
using shipped_body::drawn_pose;
using shipped_body::keypoint_distance_m;
using shipped_body::model;
using shipped_body::Picture;

const BodyCamera kPinhole = {true, 600, 600, 320, 240};

template <class Keep>
Observations observe(const BodyCamera& camera, const BodyPose& pose, Keep&& keep) {
  std::mt19937 random(21);
  const BodyBones bones = bones_of(model(), pose);
  Observations seen;
  while (seen.points.size() < 220) {
    Observation observation;
    observation.part = uint8_t(1 + random() % 24);
    observation.point = shipped_body::seen_point(model(), observation.part, int(random() % 256), int(random() % 256));
    if (observation.point.joint_count == 0) continue;
    const Vec3 at = shipped_body::place_point(model(), bones, observation.point);
    if (!keep(observation, at)) continue;
    observation.at = project(camera, pose.place, at).at;
    seen.points.push_back(observation);
  }
  seen.surface_count = seen.points.size();
  seen.size_px = 0.7 * scale_at(camera, pose.place);
  return seen;
}

void expect_sane(const FittedBody& body, const char* what) {
  ASSERT_TRUE(is_finite(body.pose, model().joints.size())) << what;
  for (const double shape : body.pose.shape) EXPECT_LE(std::abs(shape), 3) << what;
  const BodyBones bones = bones_of(model(), body.pose);
  for (const BodyPoint& point : model().vertices) ASSERT_LT(length(posed(model(), bones, point)), 2) << what;
  const double slack = 0.6;  // limits are soft
  for (size_t k = 0; k < model().angle_count(); ++k) {
    const double angle = (&body.pose.rotation[1 + k / 3].x)[k % 3];
    EXPECT_GT(angle, model().prior.low[k] - slack) << what << " " << k;
    EXPECT_LT(angle, model().prior.high[k] + slack) << what << " " << k;
  }
}

TEST(BodyExtremes, FeetAHandOrASideAloneGiveAStatusOrASaneBody) {
  BodyFitter fitter(model());
  BodyPose truth = drawn_pose(4, 0.4, 0.5);
  truth.place = {0.1, 0, 2.5};
  const auto fit = [&](const char* what, auto&& keep) {
    for (const BodyCamera& camera : {kPinhole, BodyCamera{}}) {
      BodyPose shown = truth;
      if (!camera.is_perspective) shown.place = {320, 240, 5.5};
      const FittedBody body = fitter.fit(observe(camera, shown, keep), camera, nullptr, {});
      expect_sane(body, what);
      const double inliers = body.status == FitStatus::kFitted ? body.inlier_fraction : 1;
      EXPECT_GE(inliers, 0.4) << what;
    }
  };
  fit("feet", [](const Observation& o, Vec3) { return o.part == 5 || o.part == 6; });
  fit("a hand", [](const Observation& o, Vec3) { return o.part == 3; });
  fit("the head", [](const Observation& o, Vec3) { return o.part >= 23; });
  fit("the left half", [](const Observation&, Vec3 at) { return at.x > 0; });
  fit("legs", [](const Observation& o, Vec3) { return o.part >= 5 && o.part <= 14; });
}

TEST(BodyExtremes, AHalfThatIsSeenIsFittedExactly) {
  BodyFitter fitter(model());
  BodyPose truth = drawn_pose(4, 0.4, 0.5);
  truth.place = {0.1, 0, 2.5};
  const Observations left = observe(kPinhole, truth, [](const Observation&, Vec3 at) { return at.x > 0; });
  const FittedBody body = fitter.fit(left, kPinhole, nullptr, {});
  ASSERT_EQ(body.status, FitStatus::kFitted);
  const BodyBones found = bones_of(model(), body.pose), right = bones_of(model(), truth);
  const auto knee = size_t(model().find_joint("lower_leg.L"));
  EXPECT_LT(length(found.place[knee] - right.place[knee]), 0.08);
}

TEST(BodyExtremes, TwentyPeopleOfAnImageAreEachFitted) {
  constexpr int kWidth = 1000, kHeight = 640;
  const BodyCamera camera = {true, 1000, 1000, 499.5, 319.5};
  Picture picture(kWidth, kHeight);
  std::vector<BodyPose> people;
  for (uint32_t k = 0; k < 20; ++k) {
    BodyPose pose = drawn_pose(k + 1, 0.4, 0.6 * k);
    pose.place = {-3.9 + 0.87 * (k % 10), k < 10 ? -1.35 : 1.1, 9};
    picture.paint(camera, pose, uint8_t(k + 1));
    people.push_back(pose);
  }
  PeopleFitter fitter(model());
  for (int frame = 0; frame < 2; ++frame) {
    fitter.begin_frame(picture.labels(), camera, frame * 40'000'000);
    int near = 0;
    for (uint32_t k = 0; k < 20; ++k) {
      const FittedBody body = fitter.fit({uint8_t(k + 1), int64_t(k) + 1, nullptr});
      EXPECT_EQ(body.status, FitStatus::kFitted) << k;
      expect_sane(body, "one of twenty");
      near += keypoint_distance_m(body.pose, people[k]) < 0.1 ? 1 : 0;
      const int most = frame == 1 ? 8 : 100;
      EXPECT_LE(body.iterations, most) << k;
    }
    EXPECT_GE(near, 18);
  }
}

TEST(BodyExtremes, CamerasAndPlacesAtTheEdgeGiveNoOutliers) {
  BodyFitter fitter(model());
  BodyPose truth = drawn_pose(6, 0.5, 0.2);
  const auto all = [](const Observation&, Vec3) { return true; };
  for (const double focal_px : {1.0, 30.0, 1e6}) {
    const BodyCamera camera = {true, focal_px, focal_px, 0, 0};
    truth.place = {0, 0, 4};
    expect_sane(fitter.fit(observe(camera, truth, all), camera, nullptr, {}), "focal length");
  }
  truth.place = {0, 0, 0.9};  // hands may reach behind the camera
  expect_sane(fitter.fit(observe(kPinhole, truth, all), kPinhole, nullptr, {}), "near");
  truth.place = {1e4, -1e4, 3000};
  expect_sane(fitter.fit(observe(kPinhole, truth, all), kPinhole, nullptr, {}), "far");
  Observations seen = observe(kPinhole, drawn_pose(6, 0.5, 0.2), all);
  for (Observation& observation : seen.points) observation.at.y = std::numeric_limits<double>::infinity();
  EXPECT_NE(fitter.fit(seen, kPinhole, nullptr, {}).status, FitStatus::kFitted);
  seen.size_px = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(fitter.fit(seen, kPinhole, nullptr, {}).status, FitStatus::kTooFewPixels);
}

TEST(BodyExtremes, APoseBeforeWithAnglesBeyondPiIsForgottenWithinTenFrames) {
  BodyFitter fitter(model());
  BodyPose truth = drawn_pose(5, 0.4, 3.14159265358979);  // seen from behind, a turn of pi
  truth.place = {0, 0, 3};
  const Observations seen = observe(kPinhole, truth, [](const Observation&, Vec3) { return true; });
  for (const double angle : {3.14159265358979, -3.14159265358979, 6.2, 400.0}) {
    BodyPose before = truth;
    before.rotation[size_t(model().find_joint("lower_arm.L"))].x += angle;
    before.orientation = maq::exp_rotation({0, angle, 0}) * truth.orientation;
    FittedBody body;
    for (int frame = 0; frame < 10; ++frame) {
      body = fitter.fit(seen, kPinhole, &before, {});
      ASSERT_EQ(body.status, FitStatus::kFitted) << angle;
      before = body.pose;
    }
    EXPECT_LT(keypoint_distance_m(body.pose, truth), 0.1) << angle;
  }
}

TEST(BodyExtremes, SingularEquationsAreRefusedAndSmallOnesAreSolvedAsByElimination) {
  std::vector<double> singular = {1, 0, 0, 2, 4, 0, 3, 6, 9};  // rank 1
  std::vector<double> b = {1, 2, 3};
  EXPECT_FALSE(maq::solve_positive(singular.data(), 3, 3, b.data(), 1));
  std::vector<double> none = {std::numeric_limits<double>::quiet_NaN()};
  EXPECT_FALSE(maq::solve_positive(none.data(), 1, 1, b.data(), 1));
  constexpr int kSize = 70;
  std::mt19937 random(3);
  std::vector<double> root(kSize * kSize), matrix(kSize * kSize), x(kSize), product(kSize);
  for (double& value : root) value = double(random()) / double(std::mt19937::max()) - 0.5;
  for (double& value : x) value = double(random()) / double(std::mt19937::max()) - 0.5;
  for (int i = 0; i < kSize; ++i) {
    for (int j = 0; j < kSize; ++j) {
      for (int k = 0; k < kSize; ++k) matrix[i * kSize + j] += root[i * kSize + k] * root[j * kSize + k];
      matrix[i * kSize + j] += i == j ? 0.1 : 0;
      product[i] += matrix[i * kSize + j] * x[j];
    }
  }
  ASSERT_TRUE(maq::solve_positive(matrix.data(), kSize, kSize, product.data(), 1));
  for (int i = 0; i < kSize; ++i) EXPECT_NEAR(product[i], x[i], 1e-9);
}

TEST(BodyExtremes, NoPoseNearTheFittedOneCostsLess) {
  FitSettings exact;
  exact.iterations = 200;
  BodyFitter fitter(model(), exact);
  BodyPose truth = drawn_pose(2, 0.6, 0.9);
  truth.place = {0.2, -0.1, 3};
  std::mt19937 random(8);
  Observations seen = observe(kPinhole, truth, [](const Observation&, Vec3) { return true; });
  for (Observation& observation : seen.points) {
    observation.at.x += double(random() % 1000) / 100 - 5, observation.at.y += double(random() % 1000) / 100 - 5;
  }
  const FittedBody body = fitter.fit(seen, kPinhole, nullptr, {});
  ASSERT_EQ(body.status, FitStatus::kFitted);
  FitProblem problem;
  problem.seen = &seen;
  problem.camera = kPinhole;
  problem.error_px = exact.error_of_size * seen.size_px;
  problem.data_weight = exact.independent_points / double(seen.points.size());
  FitEquations equations(model());
  const double best = equations.cost(problem, body.pose);
  for (int trial = 0; trial < 300; ++trial) {
    std::array<double, kMaxUnknowns> step{};
    const double size = trial % 2 == 0 ? 0.1 : 0.02;
    for (size_t k = 0; k < unknown_count(model()); ++k) {
      step[k] = size * (double(random()) / double(std::mt19937::max()) - 0.5);
    }
    EXPECT_GT(equations.cost(problem, stepped(model(), body.pose, step.data(), 3)), best * (1 - 1e-3)) << trial;
  }
}

TEST(BodyExtremes, TheFirstStartFitsItsPixelsAsABruteForceSearchDoes) {
  BodyPose truth = mean_pose(model());
  truth.orientation = maq::exp_rotation({0, 0, 0.5}) * kFacing * maq::exp_rotation({0, 0, 1.1});
  truth.place = {0.2, -0.1, 30};
  const BodyCamera distant = {true, 6000, 6000, 320, 240};
  const Observations seen = observe(distant, truth, [](const Observation&, Vec3) { return true; });
  StartingPoses starts(model());
  const std::vector<BodyPose>& found = starts.find(seen, distant);
  ASSERT_FALSE(found.empty());
  double cosine = -1;
  for (size_t i = 0; i < 9; ++i) cosine += found[0].orientation[i] * truth.orientation[i];
  EXPECT_GT(cosine / 2, std::cos(0.35));  // the nearest of the orientations on the grid
  EXPECT_NEAR(found[0].place.z, 30, 2);
  EXPECT_NEAR(project(distant, found[0].place, {}).at.x, project(distant, truth.place, {}).at.x, 12);
  EXPECT_NEAR(project(distant, found[0].place, {}).at.y, project(distant, truth.place, {}).at.y, 12);
}

}  // namespace
}  // namespace body_extremes
