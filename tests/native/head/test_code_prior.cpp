// What the encoder says of shape codes, as a prior of the fit.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "head/fit/anchor_fit.h"
#include "head/fit/code_prior.h"
#include "head/synthetic_head.h"
#include "support/expect_error.h"

namespace code_prior_tests {
namespace {

using namespace maq::head;       // NOLINT
using namespace synthetic_head;  // NOLINT

HeadPhoto saying(std::vector<float> codes) {
  HeadPhoto photo;
  photo.codes = std::move(codes);
  return photo;
}

TEST(CodePrior, OfNoPhotosAndSilentOnesItIsStandardNormal) {
  const HeadPhoto silent;
  for (const CodePrior& prior : {code_prior({}, 3), code_prior({&silent, &silent}, 3)}) {
    EXPECT_EQ(prior.means, std::vector<double>(3, 0.0));
    EXPECT_EQ(prior.inverse_variances, std::vector<double>(3, 1.0));
  }
}

TEST(CodePrior, OnePhotoIsTakenAtItsWordButForTheFactorOfItsSigma) {
  const HeadPhoto photo = saying({2.0f, std::log(0.25f), 2.0f, 0.5f});
  const CodePrior prior = code_prior({&photo}, 2);
  EXPECT_NEAR(prior.means[0], 2, 1e-6);
  EXPECT_NEAR(prior.inverse_variances[0], 1 / (0.3 * 0.3), 1e-4);
  // The second code is less sure than knowing nothing: it says nothing.
  EXPECT_EQ(prior.means[1], 0);
  EXPECT_EQ(prior.inverse_variances[1], 1);
  const double codes[2] = {2.3, 2};
  EXPECT_NEAR(prior.cost(codes), 1 + 4, 1e-4);
}

TEST(CodePrior, TwoPhotosMeetBetweenWithTheStandardNormalCountedOnce) {
  const HeadPhoto first = saying({1.0f, std::log(0.5f)}), second = saying({0.0f, std::log(0.5f)});
  const CodePrior prior = code_prior({&first, &second}, 1);
  const double each = 1 / (0.6 * 0.6);
  EXPECT_NEAR(prior.inverse_variances[0], 2 * each - 1, 1e-4);
  EXPECT_NEAR(prior.means[0], each / (2 * each - 1), 1e-4);
}

TEST(CodePrior, BrokenNumbersSayNothingAndAnotherCountIsRefused) {
  const float nan = std::nanf(""), inf = std::numeric_limits<float>::infinity();
  const HeadPhoto photo = saying({nan, -2.0f, 1.0f, nan, inf, -2.0f, 1.0f, -inf});
  const CodePrior prior = code_prior({&photo}, 4);
  EXPECT_EQ(prior.inverse_variances, std::vector<double>(4, 1.0));
  expect_error(MAQ_ERROR_INVALID_ARGUMENT, "shape codes", [&] { code_prior({&photo}, 3); });
}

TEST(CodePrior, CodesThatCellsDoNotShowFollowTheEncoder) {
  const FieldCodes truth = {{1.1f, -1.2f, 0.1f, -1.0f}, {0, 0}};
  Noise noise;
  noise.seed = 3, noise.point_dm = 0.01, noise.has_colours = false;
  HeadPhoto photo = photo_of(truth, camera_at(6, 900, 0.2, 0.1), noise);
  const AnchorFit alone = fit_anchors(prior(), {photo});
  for (size_t k = 0; k < 4; ++k) {
    photo.codes.insert(photo.codes.end(), {truth.shape[k], std::log(0.1f)});
  }
  const AnchorFit told = fit_anchors(prior(), {photo});
  ASSERT_TRUE(alone.is_found() && told.is_found());
  for (size_t k = 0; k < 4; ++k) {
    EXPECT_NEAR(told.shape_codes[k], truth.shape[k], 0.3f) << k;
    EXPECT_LT(told.code_sigmas[k], alone.code_sigmas[k]) << k;
  }
  // The second code lies along the line of sight: cells alone hardly tell.
  EXPECT_LT(std::abs(told.shape_codes[1] - truth.shape[1]), std::abs(alone.shape_codes[1] - truth.shape[1]));
}

}  // namespace
}  // namespace code_prior_tests
