// How sure a head's landmarks are: by the prior, by photos, and without the size.
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "head/fit/anchor_fit.h"
#include "head/reconstruction/known_anchors.h"
#include "head/synthetic_head.h"

namespace known_anchors_tests {
namespace {

using namespace maq::head;       // NOLINT
using namespace synthetic_head;  // NOLINT

constexpr size_t kCodes = 4;
constexpr float kAnchorSigma_dm = 0.015f;

std::vector<float> covariance_of(const std::vector<std::vector<float>>& directions) {
  std::vector<float> covariance(kCodes * kCodes, 0.0f);
  for (const std::vector<float>& d : directions) {
    for (size_t r = 0; r < kCodes; ++r) {
      for (size_t c = 0; c < kCodes; ++c) covariance[r * kCodes + c] += d[r] * d[c];
    }
  }
  return covariance;
}

// The anchor whose point of the mean head is farthest along the axis.
size_t end_of(size_t axis) {
  size_t found = 0;
  for (size_t i = 0; i < prior().anchors.count(); ++i) {
    if (prior().anchors.mean[3 * i + axis] > prior().anchors.mean[3 * found + axis]) found = i;
  }
  return found;
}

TEST(KnownAnchors, LieWhereTheCodesPutThem) {
  const std::vector<float> codes = {1, -0.5f, 0, 2};
  const StoredAnchors stored = known_anchors(prior(), codes, covariance_of({}));
  ASSERT_EQ(stored.count(), prior().anchors.count());
  EXPECT_EQ(stored.template_points, prior().anchors.template_points);
  for (size_t i = 0; i < stored.points.size(); ++i) {
    float point = prior().anchors.mean[i];
    for (size_t k = 0; k < kCodes; ++k) point += prior().anchors.linear[kCodes * i + k] * codes[k];
    EXPECT_NEAR(stored.points[i], point, 1e-5f);
  }
  for (const float sigma : stored.sigma) EXPECT_FLOAT_EQ(sigma, kAnchorSigma_dm) << "codes that are known add nothing";
}

TEST(KnownAnchors, ACodeThatIsNotKnownMakesUnsureWhatItMoves) {
  const StoredAnchors stored = known_anchors(prior(), {0, 0, 0, 0}, covariance_of({{1, 0, 0, 0}}));
  // Code 0 makes the head narrower by 7 %, and so smaller by the part of the width in its size: what is left of a point
  // at x from the middle is x 7 % less that part, beside as much in the other axes.
  const size_t side = end_of(0), top = end_of(2);
  double squares[3] = {}, middle[3] = {};
  const std::vector<float>& mean = prior().anchors.mean;
  for (size_t i = 0; i < mean.size(); ++i) middle[i % 3] += double(mean[i]) / double(mean.size() / 3);
  for (size_t i = 0; i < mean.size(); ++i) squares[i % 3] += std::pow(double(mean[i]) - middle[i % 3], 2);
  const double part = squares[0] / (squares[0] + squares[1] + squares[2]);
  for (const size_t anchor : {side, top}) {
    double moved = 0;
    for (size_t axis = 0; axis < 3; ++axis) {
      const double from_middle = double(mean[3 * anchor + axis]) - middle[axis];
      moved += std::pow(0.07 * from_middle * ((axis == 0 ? 1 : 0) - part), 2) / 3;
    }
    EXPECT_NEAR(stored.sigma[anchor], std::sqrt(double(kAnchorSigma_dm * kAnchorSigma_dm) + moved), 2e-3);
  }
  EXPECT_GT(stored.sigma[side], 1.5f * kAnchorSigma_dm);
}

TEST(KnownAnchors, TheSizeAloneMakesNoPlaceUnsure) {
  const StoredAnchors stored = known_anchors(prior(), {0, 0, 0, 0}, covariance_of({{1, 1, 1, 0}}));
  for (const float sigma : stored.sigma) EXPECT_NEAR(sigma, kAnchorSigma_dm, 1e-3f);
  EXPECT_NEAR(size_sigma(prior()), 0.07 / std::sqrt(3.0), 0.01) << "three axes that differ by 7 %";
}

TEST(KnownAnchors, APhotoFromTheSideMakesSureHowFarTheNoseStandsOut) {
  Noise noise;
  noise.point_dm = 0.01, noise.has_colours = false;
  const FieldCodes codes = {{1.1f, -1.2f, 0.1f, -1.0f}, {0, 0}};
  const HeadPhoto front = photo_of(codes, camera_at(6, 900, 0), noise),
                  side = photo_of(codes, camera_at(5, 700, 1.3), noise);
  AnchorFitOptions options;
  options.terms.cell_weight = 1, options.terms.pixel_sigma = 0.02;
  const AnchorFit one = fit_anchors(prior(), {front}, options), two = fit_anchors(prior(), {front, side}, options);
  ASSERT_EQ(two.used(), 2u);
  for (const AnchorFit* fit : {&one, &two}) {
    ASSERT_EQ(fit->code_covariance.size(), kCodes * kCodes);
    for (size_t r = 0; r < kCodes; ++r) {
      EXPECT_NEAR(fit->code_covariance[r * kCodes + r], fit->code_sigmas[r] * fit->code_sigmas[r], 1e-5f);
      for (size_t c = 0; c < r; ++c) {
        EXPECT_NEAR(fit->code_covariance[r * kCodes + c], fit->code_covariance[c * kCodes + r], 1e-5f);
      }
    }
  }
  size_t nose = 0;
  for (size_t i = 0; i < prior().anchors.count(); ++i) {
    if (prior().anchors.mean[3 * i + 1] < prior().anchors.mean[3 * nose + 1]) nose = i;
  }
  const float unseen =
      known_anchors(prior(), {0, 0, 0, 0}, covariance_of({{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}}))
          .sigma[nose];
  const float by_one = known_anchors(prior(), one.shape_codes, one.code_covariance).sigma[nose];
  const float by_two = known_anchors(prior(), two.shape_codes, two.code_covariance).sigma[nose];
  EXPECT_LT(by_one, unseen);
  EXPECT_LT(by_two, 0.8f * by_one);
  EXPECT_GT(by_two, kAnchorSigma_dm);
}

}  // namespace
}  // namespace known_anchors_tests
