// Cameras and codes from template points, against those that made them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "head/fit/anchor_fit.h"
#include "head/synthetic_head.h"
#include "support/expect_error.h"

namespace anchor_fit {
namespace {

using namespace maq::head;       // NOLINT
using namespace synthetic_head;  // NOLINT

const FieldCodes kTruth = {{1.1f, -1.2f, 0.1f, -1.0f}, {0, 0}};

HeadPhoto photo_for_anchors(const HeadCamera& camera, unsigned seed, double point_dm = 0.01,
                            const FieldCodes& codes = kTruth) {
  Noise noise;
  noise.seed = seed, noise.point_dm = point_dm, noise.has_colours = false;
  return photo_of(codes, camera, noise);
}

// The noise of these tests differs from cell to cell.
AnchorFitOptions independent_cells() {
  AnchorFitOptions options;
  options.terms.cell_weight = 1, options.terms.pixel_sigma = 0.02;
  return options;
}

// How far codes are off, but for the size of the head, which its distance makes up for.
double code_error(const std::vector<float>& codes) {
  double off[4], size = 0, sum = 0;
  for (size_t k = 0; k < 4; ++k) off[k] = double(codes[k]) - double(kTruth.shape[k]);
  for (size_t k = 0; k < 3; ++k) size += off[k] / 3;
  for (size_t k = 0; k < 4; ++k) sum += std::pow(k < 3 ? off[k] - size : off[k], 2);
  return std::sqrt(sum);
}

TEST(AnchorFit, CodesAndCameraAreFoundWithNoiseAndAThirdOutliers) {
  for (unsigned seed = 1; seed < 5; ++seed) {
    const HeadCamera camera = camera_at(6, 900, 0.3 * seed - 0.6, 0.1);
    const AnchorFit fit = fit_anchors(prior(), {photo_for_anchors(camera, seed)}, independent_cells());
    ASSERT_TRUE(fit.is_found());
    const PhotoFit& photo = fit.photos[0];
    EXPECT_LT(rotation_error(photo.camera, camera), 0.03);
    const Vec3 t = photo.camera.head_to_camera.translation, true_t = camera.head_to_camera.translation;
    EXPECT_NEAR(900 * t.x / t.z, 900 * true_t.x / true_t.z, 2);
    EXPECT_NEAR(900 * t.y / t.z, 900 * true_t.y / true_t.z, 2);
    EXPECT_NEAR(t.z, 6, 0.6);
    // One photo from not near tells the head's size from its distance by the prior alone.
    EXPECT_NEAR(fit.shape_codes[0] - fit.shape_codes[2], 1.0f, 0.3f);
    for (size_t k = 0; k < 4; ++k) {
      EXPECT_NEAR(fit.shape_codes[k], kTruth.shape[k], 3 * fit.code_sigmas[k] + 0.1f) << k;  // anchors are linear
    }
    EXPECT_NEAR(double(photo.inliers), 0.7 * double(photo.cells), 0.06 * double(photo.cells));
    EXPECT_LT(fit.code_sigmas[3], 0.4f);
    EXPECT_GT(fit.code_sigmas[1], 0.4f);  // along the line of sight
    EXPECT_LT(photo.rms_px, 3);
    EXPECT_EQ(photo.camera.width_px, 640);
  }
}

TEST(AnchorFit, ThreePhotosOfAHeadShareItsCodes) {
  std::vector<HeadCamera> cameras = {camera_at(6, 900, 0), camera_at(5, 700, 1.1), camera_at(8, 1200, -1.2)};
  std::vector<HeadPhoto> photos;
  for (unsigned i = 0; i < 3; ++i) photos.push_back(photo_for_anchors(cameras[i], i + 10));
  const AnchorFit fit = fit_anchors(prior(), photos, independent_cells());
  ASSERT_EQ(fit.used(), 3u);
  for (size_t i = 0; i < 3; ++i) EXPECT_LT(rotation_error(fit.photos[i].camera, cameras[i]), 0.02) << i;
  EXPECT_LT(code_error(fit.shape_codes), 0.25);
  const AnchorFit alone = fit_anchors(prior(), {photos[0]}, independent_cells());
  for (size_t k = 0; k < 4; ++k) EXPECT_LT(fit.code_sigmas[k], alone.code_sigmas[k] + 1e-3f);
  EXPECT_LT(fit.code_sigmas[1], 0.8f * alone.code_sigmas[1]);
}

TEST(AnchorFit, AFocalLengthThatIsNotKnownStaysNearItsPrior) {
  const HeadCamera camera = camera_at(6, 900, 0.4);
  HeadPhoto photo = photo_for_anchors(camera, 3);
  photo.focal_px = 750, photo.log_focal_sigma = 0.3;
  const AnchorFit fit = fit_anchors(prior(), {photo});
  ASSERT_TRUE(fit.is_found());
  EXPECT_LT(rotation_error(fit.photos[0].camera, camera), 0.06);
  EXPECT_NEAR(std::log(fit.photos[0].camera.focal_px / 750), 0, 0.6);
  EXPECT_NE(fit.photos[0].camera.focal_px, 750);
  photo.log_focal_sigma = 0;
  EXPECT_NEAR(fit_anchors(prior(), {photo}).photos[0].camera.focal_px, 750, 1e-9);
}

TEST(AnchorFit, APhotoThatShowsNoHeadIsNamedAndTheOthersGoOn) {
  const HeadCamera camera = camera_at(6, 900, 0.4);
  std::vector<HeadPhoto> photos = {photo_for_anchors(camera, 4), photo_for_anchors(camera, 5),
                                   photo_for_anchors(camera, 6)};
  std::mt19937 random(9);
  std::uniform_real_distribution<double> anywhere(-1, 1);
  for (HeadCell& cell : photos[1].seen.cells) {
    const Vec3 d = maq::normalized({anywhere(random), anywhere(random), anywhere(random)});
    cell.template_point = {0.75 * d.x, 0.95 * d.y, 1.15 * d.z};
  }
  for (HeadCell& cell : photos[2].seen.cells) cell.template_point.x = -cell.template_point.x;
  const AnchorFit fit = fit_anchors(prior(), photos);
  EXPECT_EQ(fit.used(), 1u);
  EXPECT_TRUE(fit.photos[0].is_used());
  EXPECT_EQ(fit.photos[1].status, PoseStatus::kNoConsensus);
  EXPECT_EQ(fit.photos[2].status, PoseStatus::kMirrored);
  EXPECT_EQ(fit.shape_codes, fit_anchors(prior(), {photos[0]}).shape_codes);
}

TEST(AnchorFit, APhotoThatAgreesTooLittleWithTheHeadOfAllIsLeftOut) {
  std::vector<HeadPhoto> photos;
  for (unsigned i = 0; i < 3; ++i) photos.push_back(photo_for_anchors(camera_at(6, 900, 0.3 * i), i));
  std::mt19937 random(9);
  std::normal_distribution<double> normal(0.0, 0.15);
  for (HeadCell& cell : photos[1].seen.cells) {
    cell.template_point = cell.template_point + Vec3{normal(random), normal(random), normal(random)};
  }
  const AnchorFit fit = fit_anchors(prior(), photos, independent_cells());
  EXPECT_EQ(fit.used(), 2u);
  EXPECT_EQ(fit.photos[1].status, PoseStatus::kNoConsensus);
  EXPECT_GT(fit.photos[1].cells, 100u);
  EXPECT_EQ(fit.photos[1].inliers, 0u);
  const AnchorFit without = fit_anchors(prior(), {photos[0], photos[2]}, independent_cells());
  for (size_t k = 0; k < 4; ++k) EXPECT_NEAR(fit.shape_codes[k], without.shape_codes[k], 0.02f);
}

TEST(AnchorFit, NothingNumbersThatAreNoneAndOneCellAreAStatus) {
  const HeadCamera camera = camera_at(6, 900, 0.4);
  const HeadPhoto whole = photo_for_anchors(camera, 7);
  HeadPhoto empty = whole;
  empty.seen = {};
  HeadPhoto one = whole;
  size_t left = 1;
  for (HeadCell& cell : one.seen.cells) {
    if (!cell.is_usable || cell.matte < 0.5 || left-- != 1) cell = HeadCell();
  }
  std::vector<float> nans(48 * 48 * kCellChannels, std::numeric_limits<float>::quiet_NaN());
  HeadPhoto nan = whole;
  nan.seen = read_observations(nans.data(), {}, whole.seen.crop_to_photo);
  HeadPhoto no_head = whole;
  for (HeadCell& cell : no_head.seen.cells) cell.matte = 0.1;
  for (const HeadPhoto& photo : {empty, one, nan, no_head}) {
    const AnchorFit fit = fit_anchors(prior(), {photo});
    EXPECT_FALSE(fit.is_found());
    EXPECT_EQ(fit.photos[0].status, PoseStatus::kTooFewPoints);
    EXPECT_EQ(fit.shape_codes, std::vector<float>(4, 0.0f));
    EXPECT_EQ(fit.code_sigmas, std::vector<float>(4, 1.0f));
  }
}

TEST(AnchorFit, CodesThatMoveNothingOrTheSameStayWithinThePrior) {
  const HeadPhoto photo = photo_for_anchors(camera_at(6, 900, 0.3), 5);
  // Rank 3: code 3 moves no anchor, or has the same effect as code 0.
  HeadPrior idle = prior(), doubled = prior();
  for (size_t row = 0; row < idle.anchors.linear.size(); row += 4) {
    idle.anchors.linear[row + 3] = 0;
    doubled.anchors.linear[row + 3] = doubled.anchors.linear[row];
  }
  const AnchorFit without = fit_anchors(idle, {photo}, independent_cells());
  ASSERT_TRUE(without.is_found());
  EXPECT_EQ(without.shape_codes[3], 0);
  EXPECT_FLOAT_EQ(without.code_sigmas[3], 1);
  const AnchorFit shared = fit_anchors(doubled, {photo}, independent_cells());
  ASSERT_TRUE(shared.is_found());
  EXPECT_NEAR(shared.shape_codes[3], shared.shape_codes[0], 1e-3f) << "the prior shares it between them";
  for (const float code : shared.shape_codes) EXPECT_LT(std::abs(code), 3);
  // And a code of which a step is 30 heads wide: it can be told exactly, and does not run away.
  HeadPrior steep = prior();
  for (float& value : steep.anchors.linear) value *= 1000;
  const AnchorFit held = fit_anchors(steep, {photo}, independent_cells());
  for (const float code : held.shape_codes) EXPECT_LT(std::abs(code), 0.1f);
}

TEST(AnchorFit, CellsThatAreAsSureAsAnyAreTrustedAndThoseThatKnowNothingShowNoHead) {
  const HeadCamera camera = camera_at(6, 900, 0.3);
  HeadPhoto claimed = photo_for_anchors(camera, 5);
  for (HeadCell& cell : claimed.seen.cells) cell.sigma_dm = 0.01;  // read_observations() lets none be less
  const AnchorFit sure = fit_anchors(prior(), {claimed}, independent_cells());
  ASSERT_TRUE(sure.is_found());
  EXPECT_LT(rotation_error(sure.photos[0].camera, camera), 0.05);
  for (const float code : sure.shape_codes) EXPECT_LT(std::abs(code), 3);
  for (HeadCell& cell : claimed.seen.cells) cell.sigma_dm = 3;  // nor more
  const AnchorFit unsure = fit_anchors(prior(), {claimed}, independent_cells());
  EXPECT_FALSE(unsure.is_found());
  EXPECT_EQ(unsure.shape_codes, std::vector<float>(4, 0.0f));
  EXPECT_EQ(unsure.code_sigmas, std::vector<float>(4, 1.0f));
}

TEST(AnchorFit, WhatCannotBeIsRefused) {
  const HeadPhoto photo = photo_for_anchors(camera_at(6, 900, 0), 1);
  expect_error(MAQ_ERROR_INVALID_ARGUMENT, "0 photos", [] { fit_anchors(prior(), {}); });
  expect_error(MAQ_ERROR_INVALID_ARGUMENT, "65 photos",
               [&] { fit_anchors(prior(), std::vector<HeadPhoto>(65, photo)); });
  for (const double focal : {0.0, -1.0, std::nan(""), double(INFINITY)}) {
    HeadPhoto bad = photo;
    bad.focal_px = focal;
    expect_error(MAQ_ERROR_INVALID_ARGUMENT, "focal length", [&] { fit_anchors(prior(), {bad}); });
  }
}

TEST(AnchorFit, GradientsAndEquationsAreThoseOfFiniteDifferences) {
  const HeadCamera camera = camera_at(6, 900, 0.3);
  const HeadPhoto photo = photo_for_anchors(camera, 2, 0.05);
  const AnchorPoints points(prior());
  AnchorTerms terms(photo, points, {});
  const double small[7] = {0.02, -0.03, 0.01, 2, -1, 0.02, 0.1};
  const ScaledPose pose = moved(scaled_pose_of(camera, {}), small);
  const double codes[4] = {0.5, -0.2, 0.3, -0.6};
  terms.set_noise(pose, codes, 0.2);
  double by_pose[7] = {}, by_codes[4] = {};
  const double loss = terms.gradient(pose, codes, 1, by_pose, by_codes);
  EXPECT_NEAR(loss, terms.cost(pose, codes) / 2, 1e-12 * loss);
  std::vector<double> a(11 * 11), b(11);
  terms.accumulate(pose, codes, a.data(), b.data());
  for (int k = 0; k < 11; ++k) {
    double costs[2];
    for (int side = 0; side < 2; ++side) {
      double step[7] = {}, at[4] = {codes[0], codes[1], codes[2], codes[3]};
      (k < 7 ? step[k] : at[k - 7]) += (side == 0 ? -1 : 1) * (k == 3 || k == 4 ? 1e-3 : 1e-5);
      costs[side] = terms.cost(moved(pose, step), at) / 2;
    }
    const double expected = (costs[1] - costs[0]) / (k == 3 || k == 4 ? 2e-3 : 2e-5);
    EXPECT_NEAR(k < 7 ? by_pose[k] : by_codes[k - 7], expected, 1e-5 * (1 + std::abs(expected))) << k;
    EXPECT_NEAR(-b[size_t(k)], expected, 1e-5 * (1 + std::abs(expected))) << k;
    EXPECT_GT(a[size_t(k) * 12], 0) << k;
  }
}

TEST(AnchorFit, CellsAreSpreadAndThoseFarFromAllAnchorsLeftOut) {
  HeadPhoto photo = photo_for_anchors(camera_at(6, 900, 0), 3);
  const AnchorPoints points(prior());
  AnchorTermOptions options;
  const size_t all = AnchorTerms(photo, points, options).cells();
  options.max_cells = 50;
  EXPECT_EQ(AnchorTerms(photo, points, options).cells(), 50u);
  options.max_cells = 100000;
  for (HeadCell& cell : photo.seen.cells) {
    if (cell.is_usable && cell.matte > 0.5) {
      cell.template_point = {3, 3, 3};
      break;
    }
  }
  EXPECT_EQ(AnchorTerms(photo, points, options).cells(), all - 1);
}

TEST(AnchorFit, ACloserLookTakesThePlaceOfTheFirstWhereItSeesTheHead) {
  const AnchorPoints points(prior());
  AnchorTermOptions options = independent_cells().terms;
  options.max_cells = 100000;
  double alone_error = 0, error = 0;
  for (unsigned seed = 1; seed < 5; ++seed) {
    const HeadCamera camera = camera_at(6, 900, 0.3 * seed - 0.6, 0.1);
    HeadPhoto photo = photo_for_anchors(camera, seed, 0.1);
    const AnchorFit alone = fit_anchors(prior(), {photo}, independent_cells());
    Noise noise;
    noise.seed = seed + 10, noise.point_dm = 0.01, noise.has_colours = false;
    const HeadObservations closer = photo_of(kTruth, camera, noise, 0.1, 1).seen;
    size_t around = 0, inside = 0;
    for (const HeadCell& cell : photo.seen.cells) {
      if (!cell.is_usable || cell.matte < 0.5) continue;
      const maq::Point at = closer.photo_to_crop({cell.x_px + 0.5, cell.y_px + 0.5});
      (std::max(std::abs(at.x - 96), std::abs(at.y - 96)) > 92 ? around : inside) += 1;
    }
    EXPECT_GT(around, 100u);
    EXPECT_GT(inside, 50u);
    photo.face = closer;
    EXPECT_EQ(AnchorTerms(photo, points, options).cells(), around + 48 * 48) << "of the closer look all see the head";
    const AnchorFit fit = fit_anchors(prior(), {photo}, independent_cells());
    alone_error += code_error(alone.shape_codes), error += code_error(fit.shape_codes);
    // Where nothing can be used of the closer look, nothing is lost around it.
    for (HeadCell& cell : photo.face->cells) cell = {};
    EXPECT_EQ(AnchorTerms(photo, points, options).cells(), around);
  }
  EXPECT_LT(error, 0.8 * alone_error);
}

TEST(AnchorFit, AnchorsAreMetAndBetweenThemTheyAreMixed) {
  const AnchorPoints points(prior());
  const HeadAnchors& anchors = prior().anchors;
  const float codes[4] = {1, -2, 0.5f, 0.7f};
  for (size_t i = 0; i < anchors.count(); i += 17) {
    const float *t = &anchors.template_points[3 * i], *mean = &anchors.mean[3 * i];
    const AnchorPoints::Place place = points.place({double(t[0]), double(t[1]), double(t[2])});
    EXPECT_EQ(place.anchors[0], i);
    EXPECT_NEAR(place.distance_dm, 0, 1e-6);
    const Vec3 p = points.point(place, codes);
    double rows[12];
    points.linear(place, rows);
    const double at[3] = {p.x, p.y, p.z}, middle[3] = {place.mean.x, place.mean.y, place.mean.z};
    for (size_t axis = 0; axis < 3; ++axis) {
      double expected = double(mean[axis]), linear = middle[axis];
      for (size_t k = 0; k < 4; ++k) {
        expected += double(anchors.linear[(3 * i + axis) * 4 + k]) * double(codes[k]);
        linear += rows[axis * 4 + k] * double(codes[k]);
      }
      EXPECT_NEAR(at[axis], expected, 1e-3);
      EXPECT_NEAR(at[axis], linear, 1e-9);
    }
  }
  const AnchorPoints::Place far = points.place({5, 0, 0});
  EXPECT_NEAR(far.distance_dm, 4.25, 0.1);
  EXPECT_NEAR(far.weights[0] + far.weights[1] + far.weights[2] + far.weights[3], 1, 1e-12);
}

}  // namespace
}  // namespace anchor_fit
