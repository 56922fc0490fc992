#include "head/reconstruction/earlier_head.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "core/error.h"
#include "core/math/small_solve.h"
#include "head/fit/anchor_fit.h"

namespace maq::head {
namespace {

constexpr float kMaxCode = 20;  // sigmas; a damaged file may have more, a head hardly 5

void check(const HeadPrior& prior, const std::array<uint8_t, 32>& prior_sha256, const StoredHead& head) {
  const auto codes = size_t(prior.shape_codes());
  if (head.prior_sha256 != prior_sha256 || head.codes.shape.size() != codes ||
      head.codes.colour.size() != size_t(prior.colour_codes())) {
    throw Error(MAQ_ERROR_UNSUPPORTED,
                "The head was fitted with another bundle, whose codes mean something else. Use that bundle, or fit all "
                "photos anew.");
  }
  if (head.code_factor.size() != codes * (codes + 1) / 2) {
    throw Error(MAQ_ERROR_UNSUPPORTED,
                "The head does not say how sure its photos made it, as files of version 1 do not. Fit all photos "
                "anew.");
  }
  for (const std::vector<float>* of : {&head.codes.shape, &head.codes.colour}) {
    if (!std::all_of(of->begin(), of->end(), [](float code) { return std::abs(code) <= kMaxCode; })) {
      throw Error(MAQ_ERROR_INVALID_ARGUMENT, "One of the head's codes is beyond ", kMaxCode,
                  ", as none of a head is. Fit all photos anew.");
    }
  }
  if (head.cameras.size() + kMaxFitPhotos > kMaxStoredCameras) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "The head has ", head.cameras.size(), " photos already; to more than ",
                kMaxStoredCameras - kMaxFitPhotos, " none can be added.");
  }
}

// v L, of a lower triangle row by row: to[j] = sum over k of v[k] L[k][j].
void times_factor(const float* v, const std::vector<float>& factor, size_t codes, float* to) {
  std::fill_n(to, codes, 0.0f);
  const float* weight = factor.data();
  for (size_t row = 0; row < codes; ++row) {
    for (size_t column = 0; column <= row; ++column) to[column] += v[row] * *weight++;
  }
}

HeadPrior prior_after(const HeadPrior& prior, const StoredHead& head) {
  const auto codes = size_t(prior.shape_codes());
  HeadPrior made(prior.bases.moved(head.codes, head.code_factor));
  made.sharpness = prior.sharpness;
  made.cut = prior.cut;
  made.bounds = prior.bounds;
  made.landmarks = prior.landmarks;
  made.anchors = prior.anchors;
  for (size_t i = 0; i < made.anchors.mean.size(); ++i) {
    const float* const linear = prior.anchors.linear.data() + i * codes;
    double point = double(prior.anchors.mean[i]);
    for (size_t k = 0; k < codes; ++k) point += double(linear[k]) * double(head.codes.shape[k]);
    made.anchors.mean[i] = float(point);
    times_factor(linear, head.code_factor, codes, made.anchors.linear.data() + i * codes);
  }
  return made;
}

// Root mean square distance from their middle.
double size_of(const StoredAnchors& anchors) {
  const size_t count = anchors.count();
  std::array<double, 3> middle{};
  for (size_t i = 0; i < 3 * count; ++i) middle[i % 3] += double(anchors.points[i]) / double(count);
  double squares = 0;
  for (size_t i = 0; i < 3 * count; ++i) squares += std::pow(double(anchors.points[i]) - middle[i % 3], 2);
  return count > 0 ? std::sqrt(squares / double(count)) : 0;
}

}  // namespace

std::vector<float> covariance_factor(const std::vector<float>& covariance, size_t codes) {
  std::vector<double> a(covariance.begin(), covariance.end());
  if (codes == 0 || a.size() != codes * codes || !solve_positive(a.data(), int(codes), int(codes), nullptr, 0))
    return {};
  std::vector<float> factor;
  for (size_t row = 0; row < codes; ++row) {
    for (size_t column = 0; column <= row; ++column) factor.push_back(float(a[row * codes + column]));
  }
  return factor;
}

EarlierHead::EarlierHead(const HeadPrior& prior, const std::array<uint8_t, 32>& prior_sha256, StoredHead head)
    : head_((check(prior, prior_sha256, head), std::move(head))), prior_(prior_after(prior, head_)) {}

FieldCodes EarlierHead::codes(const FieldCodes& moved) const {
  FieldCodes made = head_.codes;
  const float* weight = head_.code_factor.data();
  for (size_t row = 0; row < made.shape.size(); ++row) {
    for (size_t column = 0; column <= row; ++column) made.shape[row] += *weight++ * moved.shape[column];
  }
  for (size_t k = 0; k < made.colour.size(); ++k) made.colour[k] += moved.colour[k];
  return made;
}

std::vector<float> EarlierHead::covariance(const std::vector<float>& moved) const {
  // L C L^T, C symmetric.
  const size_t codes = head_.codes.shape.size();
  std::vector<float> by_rows(codes * codes), made(codes * codes);
  const auto times_transposed = [&](const std::vector<float>& from, std::vector<float>& to) {  // to = (L from)^T
    const float* weight = head_.code_factor.data();
    for (size_t row = 0; row < codes; ++row) {
      for (size_t k = 0; k <= row; ++k, ++weight) {
        for (size_t c = 0; c < codes; ++c) to[c * codes + row] += *weight * from[k * codes + c];
      }
    }
  };
  times_transposed(moved, by_rows);
  times_transposed(by_rows, made);
  return made;
}

HeadScale EarlierHead::scale(const HeadScale& by_prior, const StoredAnchors& anchors) const {
  if (head_.scale.source == ScaleSource::kPrior) return by_prior;
  const double before = size_of(head_.anchors), now = size_of(anchors);
  HeadScale made = head_.scale;
  if (before > 0 && now > 0) made.metres_per_unit *= before / now, made.sigma *= before / now;
  return made;
}

}  // namespace maq::head
