// Photos added to a head: its codes, and how sure they are, in place of the prior.
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "head/fit/anchor_fit.h"
#include "head/reconstruction/earlier_head.h"
#include "head/reconstruction/known_anchors.h"
#include "head/synthetic_head.h"
#include "support/expect_error.h"

namespace earlier_head_tests {
namespace {

using namespace maq::head;       // NOLINT
using namespace synthetic_head;  // NOLINT

constexpr size_t kCodes = 4;
constexpr std::array<uint8_t, 32> kSha{1, 2, 3};
const FieldCodes kTrue = {{1.1f, -1.2f, 0.1f, -1.0f}, {0, 0}};

AnchorFit fit(const HeadPrior& of, const std::vector<HeadPhoto>& photos) {
  AnchorFitOptions options;
  options.terms.cell_weight = 1, options.terms.pixel_sigma = 0.02;
  return fit_anchors(of, photos, options);
}

HeadPhoto seen_from(double yaw_rad) {
  Noise noise;
  noise.point_dm = 0.03, noise.has_colours = false;
  return photo_of(kTrue, camera_at(6, 900, yaw_rad), noise);
}

StoredHead head_of(const std::vector<float>& codes, const std::vector<float>& covariance) {
  StoredHead head(prior().bases.combine({codes, {0.5f, -0.25f}}));
  head.codes = {codes, {0.5f, -0.25f}};
  head.code_factor = covariance_factor(covariance, kCodes);
  head.anchors = known_anchors(prior(), codes, covariance);
  head.prior_sha256 = kSha;
  return head;
}

TEST(EarlierHead, IsAPriorOfTheSameHeads) {
  const AnchorFit first = fit(prior(), {seen_from(0)});
  const EarlierHead earlier(prior(), kSha, head_of(first.shape_codes, first.code_covariance));
  const FieldCodes moved = {{0.5f, -1, 2, 0.25f}, {1, 2}}, codes = earlier.codes(moved);
  EXPECT_EQ(codes.colour, (std::vector<float>{1.5f, 1.75f}));
  const FieldWeights by_moved = earlier.prior().bases.combine(moved), by_codes = prior().bases.combine(codes);
  for (size_t i = 0; i < by_codes.values().size(); ++i) {
    ASSERT_NEAR(by_moved.values()[i], by_codes.values()[i], 1e-5f * (1 + std::abs(by_codes.values()[i]))) << i;
  }
  const std::vector<float> known(kCodes * kCodes);
  const StoredAnchors a = known_anchors(earlier.prior(), moved.shape, known),
                      b = known_anchors(prior(), codes.shape, known);
  for (size_t i = 0; i < a.points.size(); ++i) ASSERT_NEAR(a.points[i], b.points[i], 1e-5f) << i;
  std::vector<float> unit(kCodes * kCodes);
  for (size_t k = 0; k < kCodes; ++k) unit[k * kCodes + k] = 1;
  const std::vector<float> covariance = earlier.covariance(unit);
  for (size_t i = 0; i < covariance.size(); ++i) EXPECT_NEAR(covariance[i], first.code_covariance[i], 1e-5f) << i;
}

TEST(EarlierHead, PhotosOneAfterTheOtherSayWhatTheySayTogether) {
  const HeadPhoto front = seen_from(0), side = seen_from(1.3);
  const AnchorFit one = fit(prior(), {front}), both = fit(prior(), {front, side});
  const EarlierHead earlier(prior(), kSha, head_of(one.shape_codes, one.code_covariance));
  const AnchorFit later = fit(earlier.prior(), {side});
  ASSERT_EQ(later.used(), 1u);
  const std::vector<float> codes = earlier.codes({later.shape_codes, {0, 0}}).shape;
  const std::vector<float> covariance = earlier.covariance(later.code_covariance);
  for (size_t k = 0; k < kCodes; ++k) {
    const float sigma = both.code_sigmas[k];
    EXPECT_NEAR(codes[k], both.shape_codes[k], sigma) << "within what both leave of it; code " << k;
    EXPECT_NEAR(std::sqrt(covariance[k * kCodes + k]), sigma, 0.1f * sigma) << k;
    EXPECT_LT(sigma, one.code_sigmas[k]) << k;
  }
}

TEST(EarlierHead, OfKnownSizeStaysAsLarge) {
  const std::vector<float> codes(kCodes), covariance(kCodes * kCodes);
  StoredHead head = head_of(codes, covariance);
  head.code_factor.assign(kCodes * (kCodes + 1) / 2, 0.0f);
  StoredAnchors larger = head.anchors;
  for (float& value : larger.points) value *= 1.25f;
  const HeadScale average{0.1, 0.004, ScaleSource::kPrior};
  EXPECT_EQ(EarlierHead(prior(), kSha, head).scale(average, larger).metres_per_unit, 0.1);
  head.scale = {0.11, 0.002, ScaleSource::kDepth};
  const HeadScale kept = EarlierHead(prior(), kSha, head).scale(average, larger);
  EXPECT_EQ(kept.source, ScaleSource::kDepth);
  EXPECT_NEAR(kept.metres_per_unit * 1.25, 0.11, 1e-6);
  EXPECT_NEAR(kept.sigma * 1.25, 0.002, 1e-7);
}

TEST(EarlierHead, ThatCannotBeGoneOnFromIsRefused) {
  const std::vector<float> covariance = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
  const StoredHead head = head_of({0, 1, 0, 0}, covariance);
  const EarlierHead fine(prior(), kSha, head);
  const auto refuse = [&](maq_status status, const char* text, auto&& change) {
    StoredHead changed = head;
    change(changed);
    expect_error(status, text, [&] { EarlierHead(prior(), kSha, changed); });
  };
  refuse(MAQ_ERROR_UNSUPPORTED, "another bundle", [](StoredHead& h) { h.prior_sha256[31] = 1; });
  refuse(MAQ_ERROR_UNSUPPORTED, "another bundle", [](StoredHead& h) { h.codes.colour.clear(); });
  refuse(MAQ_ERROR_UNSUPPORTED, "version 1", [](StoredHead& h) { h.code_factor.clear(); });
  refuse(MAQ_ERROR_INVALID_ARGUMENT, "beyond 20", [](StoredHead& h) { h.codes.shape[0] = -21; });
  refuse(MAQ_ERROR_INVALID_ARGUMENT, "193 photos", [](StoredHead& h) { h.cameras.resize(193); });
}

TEST(EarlierHead, CovariancesThatAreNoneHaveNoFactor) {
  EXPECT_TRUE(covariance_factor({}, 0).empty());
  EXPECT_TRUE(covariance_factor({1, 2, 2, 1}, 2).empty());
  EXPECT_TRUE(covariance_factor({1, 0, 0}, 2).empty());
  EXPECT_EQ(covariance_factor({4, 2, 2, 10}, 2), (std::vector<float>{2, 1, 3}));
}

}  // namespace
}  // namespace earlier_head_tests
