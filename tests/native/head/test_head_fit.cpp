// A head fitted along rays, against the one that was photographed.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "head/fit/head_fit.h"
#include "head/synthetic_head.h"
#include "support/expect_error.h"

namespace head_fit {
namespace {

using namespace maq::head;       // NOLINT
using namespace synthetic_head;  // NOLINT

const FieldCodes kTruth = {{1.1f, -1.2f, 0.1f, -1.0f}, {1.0f, -0.7f}};

HeadPhoto photo_for_fit(const HeadCamera& camera, unsigned seed, double point_dm = 0.01) {
  Noise noise;
  noise.seed = seed, noise.point_dm = point_dm;
  return photo_of(kTruth, camera, noise);
}

// The noise of these tests differs from cell to cell, and no time ends them.
HeadFitOptions independent_cells(int max_steps) {
  HeadFitOptions options;
  options.seconds = 1e6, options.max_steps = max_steps;
  options.anchors.terms.cell_weight = options.ray_weight = 1, options.anchors.terms.pixel_sigma = 0.02;
  options.rays.point_sigma_dm = 0.02;
  return options;
}

// How far codes are off where the size of the head, which its distance makes up for, is free.
double shape_error(const std::vector<float>& codes) {
  double off[4], size = 0, sum = 0;
  for (size_t k = 0; k < 4; ++k) off[k] = double(codes[k]) - double(kTruth.shape[k]);
  for (size_t k = 0; k < 3; ++k) size += off[k] / 3;
  for (size_t k = 0; k < 4; ++k) sum += std::pow(k < 3 ? off[k] - size : off[k], 2);
  return std::sqrt(sum);
}

// How far the true head's surface is from the fitted one, on average (dm), where the camera sees both at one size.
double surface_error(const FieldCodes& codes, const HeadCamera& camera, const HeadCamera& true_camera) {
  std::vector<Vec3> from, to(200);
  for (int i = 0; i < 200; ++i) {
    const double z = 1 - (2 * i + 1.0) / 200, r = std::sqrt(1 - z * z), angle = 2.399963 * i;
    from.push_back(2 * Vec3{r * std::cos(angle), r * std::sin(angle), z});
  }
  const std::vector<float> hits = first_hits(prior().bases.combine(kTruth), from, to);
  const double size = camera.head_to_camera.translation.z / true_camera.head_to_camera.translation.z;
  std::vector<float> columns[3], distances(200);
  for (size_t i = 0; i < 200; ++i) {
    const Vec3 seen = true_camera.head_to_camera * ((1 - double(hits[i])) * from[i]);
    const Vec3 p = inverse(camera.head_to_camera) * (size * seen);
    columns[0].push_back(float(p.x)), columns[1].push_back(float(p.y)), columns[2].push_back(float(p.z));
  }
  FieldEngine engine(field_shape());
  engine.set_weights(prior().bases.combine(codes));
  FieldWorkspace workspace;
  engine.distances({columns[0].data(), columns[1].data(), columns[2].data(), 200}, workspace, distances.data());
  double sum = 0;
  for (const float distance : distances) sum += double(std::abs(distance)) / 200;
  return sum;
}

double colour_error(const std::vector<float>& codes) {
  return std::hypot(double(codes[0] - kTruth.colour[0]), double(codes[1] - kTruth.colour[1]));
}

HeadFit fit_of(const std::vector<HeadPhoto>& photos, const HeadFitOptions& options, int thread_count = 1,
               const HeadFitCallback& callback = {}) {
  maq::WorkerThreads threads(thread_count);
  return fit_head(prior(), photos, options, threads, callback);
}

TEST(HeadFit, CodesColoursAndCameraComeNearerThanStage0) {
  double before = 0, after = 0;
  for (unsigned seed = 1; seed < 4; ++seed) {
    const HeadCamera camera = camera_at(6, 900, 0.3 * seed - 0.6, 0.1);
    const HeadFit fit = fit_of({photo_for_fit(camera, seed, 0.06)}, independent_cells(200), 2);
    const HeadFitStats& stats = fit.stats;
    EXPECT_TRUE(stats.end == HeadFitEnd::kSteps || stats.end == HeadFitEnd::kNoGain) << int(stats.end);
    EXPECT_GE(stats.steps, 60);
    EXPECT_EQ(stats.rays, size_t(256 * stats.steps));
    EXPECT_GT(stats.pixels, 3000u);
    EXPECT_NEAR(double(stats.held_out), 0.05 * double(stats.pixels), 0.03 * double(stats.pixels));
    EXPECT_EQ(stats.left_out, 0u);
    EXPECT_LT(stats.last.total(), 0.95 * stats.first.total());
    EXPECT_LT(stats.last.colour, 0.1 * stats.first.colour);
    EXPECT_LT(colour_error(fit.codes.colour), 0.35) << seed;
    EXPECT_LT(rotation_error(fit.photos[0].camera, camera), 0.07) << seed;
    EXPECT_NEAR(fit.photos[0].camera.focal_px, 900, 1e-6);
    EXPECT_EQ(fit.photos[0].camera.width_px, 640);
    EXPECT_EQ(fit.weights.values(), prior().bases.combine(fit.codes).values());
    before += surface_error({fit.start.shape_codes, {0, 0}}, fit.start.photos[0].camera, camera) / 3;
    after += surface_error(fit.codes, fit.photos[0].camera, camera) / 3;
  }
  EXPECT_LT(after, 0.95 * before);
  EXPECT_LT(after, 0.055);
}

TEST(HeadFit, TwoPhotosShareTheCodesAndHaveCamerasOfTheirOwn) {
  const std::vector<HeadCamera> cameras = {camera_at(6, 900, 0.1), camera_at(5, 700, -1.0)};
  std::vector<HeadPhoto> photos;
  for (unsigned i = 0; i < 2; ++i) photos.push_back(photo_for_fit(cameras[i], i + 20));
  HeadPhoto empty = photos[0];
  empty.seen = {};
  photos.insert(photos.begin() + 1, empty);
  photos[2].log_focal_sigma = 0.2, photos[2].focal_px = 650;
  const HeadFit fit = fit_of(photos, independent_cells(150), 2);
  ASSERT_EQ(fit.photos.size(), 3u);
  EXPECT_FALSE(fit.photos[1].is_used());
  EXPECT_LT(rotation_error(fit.photos[0].camera, cameras[0]), 0.02);
  EXPECT_LT(rotation_error(fit.photos[2].camera, cameras[1]), 0.02);
  EXPECT_NEAR(fit.photos[0].camera.focal_px, 900, 1e-6);
  EXPECT_NEAR(std::log(fit.photos[2].camera.focal_px / 700), 0, 0.3);
  EXPECT_LT(shape_error(fit.codes.shape), 0.3);
  EXPECT_LT(colour_error(fit.codes.colour), 0.3);
}

TEST(HeadFit, WithoutTimeItIsTheHeadOfStage0) {
  HeadFitOptions options = independent_cells(100);
  options.seconds = 0;
  const HeadPhoto photo = photo_for_fit(camera_at(6, 900, 0.2), 1);
  const HeadFit fit = fit_of({photo}, options);
  EXPECT_EQ(fit.stats.end, HeadFitEnd::kNoTime);
  EXPECT_EQ(fit.stats.steps, 0);
  EXPECT_EQ(fit.stats.rays, 0u);
  EXPECT_EQ(fit.codes.shape, fit_anchors(prior(), {photo}, options.anchors).shape_codes);
  EXPECT_EQ(fit.codes.colour, std::vector<float>(2, 0.0f));
  EXPECT_EQ(fit.weights.values(), prior().bases.combine(fit.codes).values());
}

TEST(HeadFit, TheTimeEndsIt) {
  HeadFitOptions options = independent_cells(1000000);
  options.seconds = 0.2, options.patience = 1000000;
  const HeadFit fit = fit_of({photo_for_fit(camera_at(6, 900, 0.2), 1)}, options);
  EXPECT_EQ(fit.stats.end, HeadFitEnd::kSeconds);
  EXPECT_LE(fit.stats.last.total(), fit.stats.first.total());
}

TEST(HeadFit, NothingNumbersThatAreNoneAndOneCellAreTheMeanHead) {
  const HeadPhoto whole = photo_for_fit(camera_at(6, 900, 0.4), 7);
  HeadPhoto empty = whole, one = whole, nan = whole;
  empty.seen = {};
  size_t left = 1;
  for (HeadCell& cell : one.seen.cells) {
    if (!cell.is_usable || cell.matte < 0.5 || left-- != 1) cell = HeadCell();
  }
  const std::vector<float> nans(48 * 48 * kCellChannels, std::numeric_limits<float>::quiet_NaN());
  nan.seen = read_observations(nans.data(), {}, whole.seen.crop_to_photo);
  for (const HeadPhoto& photo : {empty, one, nan}) {
    const HeadFit fit = fit_of({photo}, independent_cells(100));
    EXPECT_EQ(fit.stats.end, HeadFitEnd::kNoCamera);
    EXPECT_EQ(fit.codes.shape, std::vector<float>(4, 0.0f));
    EXPECT_EQ(fit.weights.values(), prior().bases.constant().values());
  }
}

TEST(HeadFit, ColoursThatAreNoNumbersOrMissingAreLeftOut) {
  const HeadPhoto whole = photo_for_fit(camera_at(6, 900, 0.4), 7);
  HeadPhoto none = whole, nan = whole;
  none.rgb.clear();
  std::fill(nan.rgb.begin(), nan.rgb.end(), std::numeric_limits<float>::quiet_NaN());
  const HeadFit a = fit_of({none}, independent_cells(30)), b = fit_of({nan}, independent_cells(30));
  EXPECT_EQ(a.codes.shape, b.codes.shape);
  EXPECT_EQ(a.codes.colour, std::vector<float>(2, 0.0f));
  EXPECT_EQ(a.stats.last.colour, 0);
  EXPECT_LT(a.stats.last.total(), a.stats.first.total());
}

TEST(HeadFit, CancelledAtEachStepItIsTheBestHeadSoFar) {
  const HeadPhoto photo = photo_for_fit(camera_at(6, 900, 0.2), 1);
  HeadFitOptions options = independent_cells(40);
  options.check_steps = 4;
  double last = INFINITY;
  for (int stop = 0; stop <= 12; ++stop) {
    int calls = 0;
    double loss = 0;
    const HeadFit fit = fit_of({photo}, options, 1, [&](const HeadFitProgress& progress) {
      EXPECT_EQ(progress.steps, calls);
      EXPECT_EQ(progress.photos.size(), 1u);
      loss = progress.loss;
      return calls++ < stop;
    });
    EXPECT_EQ(fit.stats.end, HeadFitEnd::kCancelled);
    EXPECT_EQ(fit.stats.steps, stop);
    EXPECT_EQ(fit.stats.last.total(), loss);
    EXPECT_LE(loss, last);
    last = loss;
    EXPECT_EQ(fit.weights.values(), prior().bases.combine(fit.codes).values());
    if (stop < 4) {
      EXPECT_EQ(fit.codes.shape, fit.start.shape_codes);
    }
  }
}

TEST(HeadFit, TheSameBitsTwiceAndForAnyNumberOfThreads) {
  const std::vector<HeadPhoto> photos = {photo_for_fit(camera_at(6, 900, 0.2), 1)};
  const HeadFitOptions options = independent_cells(45);
  const HeadFit first = fit_of(photos, options, 1);
  for (const int threads : {1, 2, 3}) {
    const HeadFit again = fit_of(photos, options, threads);
    EXPECT_EQ(again.codes.shape, first.codes.shape);
    EXPECT_EQ(again.codes.colour, first.codes.colour);
    EXPECT_EQ(again.photos[0].camera.head_to_camera.rotation, first.photos[0].camera.head_to_camera.rotation);
    EXPECT_EQ(again.weights.values(), first.weights.values());
    EXPECT_EQ(again.stats.last.total(), first.stats.last.total());
    EXPECT_EQ(again.stats.steps, first.stats.steps);
  }
  HeadFitOptions other = options;
  other.seed = 2;
  EXPECT_NE(fit_of(photos, other).codes.shape, first.codes.shape);
}

TEST(HeadFit, StepsThatExplodeAreRefusedAndTheBestHeadIsKept) {
  const std::vector<HeadPhoto> photos = {photo_for_fit(camera_at(6, 900, 0.2), 1)};
  for (const double rate : {30.0, 1e3, 1e6}) {
    HeadFitOptions options = independent_cells(100);
    options.shape_rate = options.colour_rate = rate;
    options.camera_rate = rate / 100;
    const HeadFit fit = fit_of(photos, options);
    EXPECT_GT(fit.stats.refused, 0) << rate;
    EXPECT_LE(fit.stats.last.total(), fit.stats.first.total());
    EXPECT_TRUE(std::isfinite(fit.stats.last.total()));
    for (const float code : fit.codes.shape) EXPECT_LT(std::abs(code), 4);
    if (rate == 1e6) {
      EXPECT_EQ(fit.stats.end, HeadFitEnd::kRefused);
      EXPECT_EQ(fit.codes.shape, fit.start.shape_codes);
    }
  }
}

TEST(HeadFit, AfterARefusedStepItGoesOnFromTheBestHead) {
  HeadFitOptions options = independent_cells(100);
  options.shape_rate = 6;  // from 4 on steps are refused; from 8 on the end depends on the last bits of a processor
  const HeadFit fit = fit_of({photo_for_fit(camera_at(6, 900, 0.2), 1)}, options);
  EXPECT_GT(fit.stats.refused, 0);
  EXPECT_NE(fit.stats.end, HeadFitEnd::kRefused);
  EXPECT_LT(fit.stats.last.colour, 0.5 * fit.stats.first.colour);
  EXPECT_LT(fit.stats.last.total(), 0.95 * fit.stats.first.total());
}

}  // namespace
}  // namespace head_fit
