// Sizes of bodies: against another implementation, against a solid whose sizes are known, and their intervals.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "body/fit/body_fitter.h"
#include "body/sizes/size_intervals.h"
#include "support/expect_error.h"
#include "support/samples/shipped_body.h"

namespace body_sizes {
namespace {

using namespace maq::body;  // NOLINT
using maq::Vec3;
using shipped_body::drawn_pose;
using shipped_body::model;

const BodyCamera kPinhole = {true, 600, 600, 320, 240};
constexpr auto kHeight = size_t(Size::kHeight), kChest = size_t(Size::kChest), kWaist = size_t(Size::kWaist),
               kHip = size_t(Size::kHip), kInseam = size_t(Size::kInseam);

Observations observe(const BodyPose& pose, const BodyCamera& camera, int last_part = 24, int first_part = 1) {
  std::mt19937 random(11);
  const BodyBones bones = bones_of(model(), pose);
  Observations seen;
  while (seen.points.size() < 220) {
    Observation observation;
    observation.part = uint8_t(1 + random() % 24);
    observation.point = shipped_body::seen_point(model(), observation.part, int(random() % 256), int(random() % 256));
    if (observation.part < first_part || observation.part > last_part || observation.point.joint_count == 0) continue;
    observation.at = project(camera, pose.place, shipped_body::place_point(model(), bones, observation.point)).at;
    seen.points.push_back(observation);
  }
  seen.surface_count = seen.points.size();
  seen.size_px = 0.7 * scale_at(camera, pose.place);
  return seen;
}

FittedBody fitted(const Observations& seen, double height_m) {
  BodyFitter fitter(model());
  ShapePrior shape;
  shape.height_m = height_m;
  return fitter.fit(seen, kPinhole, nullptr, shape);
}

std::array<SizeEstimate, kSizes> sizes_of(const FittedBody& body, double height_m) {
  return estimate_sizes(BodySizes(model()), model().shape_count, body.size_shape, height_m);
}

double width_of(const SizeEstimate& size) { return std::log(size.high_m / size.low_m); }

TEST(BodySizes, AreThoseOfTheReferenceInFloat64) {
  const std::string bytes = read_text(std::string(MAQ_TEST_DATA) + "/tiny_body/sizes.f64");
  std::vector<double> values(bytes.size() / sizeof(double));
  std::memcpy(values.data(), bytes.data(), bytes.size());
  ASSERT_EQ(values.size(), 8u * 15);
  const BodySizes sizes(model());
  for (size_t number = 0; number < 8; ++number) {
    const double* const row = values.data() + 15 * number;
    ShapeNumbers shape{};
    std::copy_n(row, 10, shape.begin());
    const Sizes found = sizes.sizes_m(shape);
    for (size_t k = 0; k < kSizes; ++k) EXPECT_NEAR(found[k], row[10 + k], 1e-9) << number << " " << k;
  }
}

TEST(BodySizes, OfTheMeanBodyAreThoseOfAPerson) {
  const Sizes found = BodySizes(model()).sizes_m({});
  EXPECT_NEAR(found[kHeight], 1.817, 0.002);
  EXPECT_GT(found[kHip], found[kWaist]);
  EXPECT_GT(found[kChest], found[kWaist]);
  EXPECT_GT(found[kInseam], 0.4 * found[kHeight]);
  EXPECT_LT(found[kInseam], 0.52 * found[kHeight]);
}

TEST(BodySizes, TheShapeOfSizesIsThatOfAStrongerPrior) {
  // Two coefficients that an image tells with precisions 3 and 0, the first as 2, against a prior of 1.
  const auto expect_right = [](const FittedShape& fitted, const char* what) {
    SizeShape shape;
    ASSERT_TRUE(find_shape_for_sizes(2, fitted, shape)) << what;
    EXPECT_NEAR(shape.mean[0], 3 * 2.0 / (3 + 4), 1e-12) << what;
    EXPECT_NEAR(shape.mean[1], 0, 1e-12) << what;
    EXPECT_NEAR(shape.covariance[0], 4.0 / (3 + 4), 1e-12) << what;
    EXPECT_NEAR(shape.covariance[kMaxShapes + 1], 1, 1e-12) << what;  // as before any image
  };
  FittedShape fitted;
  fitted.shape[0] = 3 * 2.0 / (3 + 1);
  fitted.covariance[0] = 1.0 / (3 + 1), fitted.covariance[kMaxShapes + 1] = 1;
  expect_right(fitted, "alone");
  fitted.prior_mean = {0.7, -0.4};
  fitted.prior_precision = 6;
  fitted.shape[0] = (3 * 2.0 + 6 * 0.7) / (3 + 6), fitted.shape[1] = -0.4;
  expect_right(fitted, "after other frames");
  fitted.image_weight = 0.5;
  fitted.shape[0] = (1.5 * 2 + 6 * 0.7) / (1.5 + 6);
  fitted.covariance[0] = 1 / (1.5 + 1);
  expect_right(fitted, "with half of its weight");
  fitted.covariance[0] = 0;
  SizeShape shape;
  EXPECT_FALSE(find_shape_for_sizes(2, fitted, shape));
}

// A tube of 1 m with a square section of 0.4 m, with an arm beside it.
BodyModel tube() {
  BodyModel made;
  made.shape_count = 1;
  const char* const names[] = {"pelvis",      "neck",   "upper_leg.L", "upper_leg.R", "upper_arm.L",
                               "lower_arm.L", "hand.L", "upper_arm.R", "lower_arm.R", "hand.R"};
  for (const char* name : names) {
    BodyJoint joint;
    joint.name = name;
    joint.parent = made.joints.empty() ? -1 : 0;
    made.joints.push_back(joint);
  }
  made.joints[1].rest.z = 0.6;
  const auto add_tube = [&](double middle, double half, uint8_t joint) {
    const auto first = uint32_t(made.vertices.size());
    for (const double z : {-0.4, 0.6}) {
      for (const auto& [x, y] : {std::pair{-1, -1}, {1, -1}, {1, 1}, {-1, 1}, {0, -1}}) {
        BodyPoint point;
        point.rest = {middle + half * x, half * y, z};
        point.basis[0] = {half * x, 0, 0};  // twice as wide after one unit
        point.joints[0] = joint;
        point.weights[0] = 1;
        made.vertices.push_back(point);
      }
    }
    for (uint32_t k = 0; k < 4; ++k) {
      const uint32_t a = first + k, b = first + (k + 1) % 4;
      for (const uint32_t corner : {a, b, b + 5, a, b + 5, a + 5}) made.triangles.push_back(corner);
    }
  };
  add_tube(0, 0.2, 0);
  add_tube(0.7, 0.05, 4);
  return made;
}

TEST(BodySizes, GirthsOfATubeAreItsPerimeterWithoutItsArm) {
  const BodyModel model = tube();
  const BodySizes sizes(model);
  const Sizes mean = sizes.sizes_m({}), wide = sizes.sizes_m({1});
  for (const size_t girth : {kChest, kWaist, kHip}) {
    EXPECT_NEAR(mean[girth], 1.6, 1e-12);
    EXPECT_NEAR(wide[girth], 2.4, 1e-12);
  }
  EXPECT_NEAR(mean[kHeight], 1, 1e-12);
  EXPECT_NEAR(mean[kInseam], 0, 1e-12);  // the lowest vertex is that of the crotch
}

TEST(BodySizes, ABodyWithoutTheirJointsIsRefused) {
  BodyModel wrong = tube();
  wrong.joints[6].name = "claw.L";
  expect_error(MAQ_ERROR_BAD_BUNDLE, "has no joint hand.L", [&] { BodySizes sizes(wrong); });
}

TEST(BodySizes, AKnownHeightSetsTheScaleOfBodyAndPlace) {
  for (const double height_m : {1.4, 1.6, 1.8, 2.0, 2.25}) {
    BodyPose truth = drawn_pose(3, 0.5, 0.3);
    truth.place = {0.2, 0, 3};
    const ShapeLength height = height_of(model());
    truth.shape[0] += (height_m - height.of(truth.shape)) / height.by_shape_m[0];
    const Observations seen = observe(truth, kPinhole);
    const FittedBody known = fitted(seen, height_m);
    ASSERT_EQ(known.status, FitStatus::kFitted) << height_m;
    EXPECT_NEAR(height.of(known.pose.shape), height_m, 0.01);
    EXPECT_NEAR(known.pose.place.z, 3, 0.1) << height_m;
    const Sizes true_sizes = BodySizes(model()).sizes_m(truth.shape);
    const auto sizes = sizes_of(known, height_m);
    EXPECT_NEAR(sizes[kHeight].value_m, height_m, 1e-9);
    EXPECT_EQ(sizes[kHeight].low_m, sizes[kHeight].high_m);
    for (const size_t k : {kChest, kWaist, kHip, kInseam}) {
      EXPECT_LT(sizes[k].low_m, true_sizes[k]) << height_m << " " << k;
      EXPECT_GT(sizes[k].high_m, true_sizes[k]) << height_m << " " << k;
      EXPECT_NEAR(sizes[k].value_m, true_sizes[k], 0.08 * true_sizes[k]) << height_m << " " << k;
    }
  }
}

TEST(BodySizes, AHeightThatBecomesKnownInAStreamSetsTheScaleAtOnce) {
  BodyPose truth = drawn_pose(3, 0.5, 0.3);
  const ShapeLength height = height_of(model());
  truth.shape[0] += (2.1 - height.of(truth.shape)) / height.by_shape_m[0];
  for (const BodyCamera& camera : {kPinhole, BodyCamera{}}) {
    truth.place = camera.is_perspective ? Vec3{0.2, 0, 3} : Vec3{320, 240, 5.3};
    const Observations seen = observe(truth, camera);
    BodyFitter fitter(model());
    ShapePrior small;
    small.height_m = 1.45;
    FittedBody body = fitter.fit(seen, camera, nullptr, small);
    ASSERT_EQ(body.status, FitStatus::kFitted);
    ShapePrior tall;
    tall.height_m = 2.1;
    const BodyPose before = body.pose;
    body = fitter.fit(seen, camera, &before, tall, body.noise);
    ASSERT_EQ(body.status, FitStatus::kFitted);
    EXPECT_LE(body.iterations, 8);
    EXPECT_NEAR(height.of(body.pose.shape), 2.1, 0.01);
    EXPECT_NEAR(body.pose.place.z, truth.place.z, 0.04 * truth.place.z);
  }
}

TEST(BodySizes, WithoutAHeightTheIntervalsAreThoseOfAllPeople) {
  BodyPose truth = drawn_pose(3, 0.5, 0.3);
  truth.place = {0.2, 0, 3};
  const Observations seen = observe(truth, kPinhole);
  const FittedBody unknown = fitted(seen, 0);
  ASSERT_EQ(unknown.status, FitStatus::kFitted);
  const auto wide = sizes_of(unknown, 0);
  const double height_m = height_of(model()).of(truth.shape);
  const auto narrow = sizes_of(fitted(seen, height_m), height_m);
  for (size_t k = 0; k < kSizes; ++k) {
    EXPECT_LT(wide[k].low_m, wide[k].value_m);
    EXPECT_GT(width_of(wide[k]), 1.2 * width_of(narrow[k])) << k;
  }
  EXPECT_GT(width_of(wide[kHeight]), 0.15);
  EXPECT_LT(width_of(wide[kHeight]), 0.6);
}

TEST(BodySizes, ShowingTheUpperBodyAloneMakesTheInseamLessCertain) {
  BodyPose truth = drawn_pose(3, 0.3, 0.3);
  truth.place = {0.2, 0, 3};
  const double height_m = height_of(model()).of(truth.shape);
  const FittedBody whole = fitted(observe(truth, kPinhole), height_m),
                   upper = fitted(observe(truth, kPinhole, 24, 15), height_m);
  ASSERT_EQ(upper.status, FitStatus::kFitted);
  EXPECT_GT(width_of(sizes_of(upper, height_m)[kInseam]), width_of(sizes_of(whole, height_m)[kInseam]));
  EXPECT_GT(width_of(sizes_of(upper, height_m)[kHip]), width_of(sizes_of(whole, height_m)[kHip]));
}

TEST(BodySizes, EarlierFramesDoNotMakeIntervalsNarrower) {
  BodyPose truth = drawn_pose(3, 0.3, 0.3);
  truth.place = {0.2, 0, 3};
  const Observations seen = observe(truth, kPinhole);
  BodyFitter fitter(model());
  const FittedBody first = fitter.fit(seen, kPinhole, nullptr, {});
  ShapePrior settled;
  settled.mean = first.pose.shape;
  settled.precision = 31;
  const FittedBody later = fitter.fit(seen, kPinhole, &first.pose, settled);
  ASSERT_EQ(later.status, FitStatus::kFitted);
  const auto before = sizes_of(first, 0), after = sizes_of(later, 0);
  for (size_t k = 0; k < kSizes; ++k) EXPECT_NEAR(width_of(after[k]), width_of(before[k]), 0.2 * width_of(before[k]));
}

TEST(BodySizes, ABodyWithASizeOfZeroHasNoSizesInsteadOfNonsense) {
  const BodyModel model = tube();
  SizeShape flat;
  flat.mean[0] = -1;  // no width, and its inseam is 0
  const auto sizes = estimate_sizes(BodySizes(model), 1, flat, 0);
  for (const SizeEstimate& size : sizes) EXPECT_EQ(size.value_m, 0);
}

}  // namespace
}  // namespace body_sizes
