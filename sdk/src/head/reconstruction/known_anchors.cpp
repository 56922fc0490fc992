#include "head/reconstruction/known_anchors.h"

#include <array>
#include <cmath>
#include <cstddef>

namespace maq::head {
namespace {

// How the anchors' mean distance from their middle depends on the codes.
struct SizeByCodes {
  std::array<double, 3> middle{};
  std::vector<double> slope;  // of each code, as a fraction of the size
};

SizeByCodes size_by_codes(const HeadPrior& prior) {
  const HeadAnchors& anchors = prior.anchors;
  const size_t count = anchors.count(), codes = size_t(prior.shape_codes());
  SizeByCodes size;
  for (size_t i = 0; i < 3 * count; ++i) size.middle[i % 3] += double(anchors.mean[i]) / double(count);
  double squares = 0;
  size.slope.resize(codes);
  for (size_t i = 0; i < 3 * count; ++i) {
    const double from_middle = double(anchors.mean[i]) - size.middle[i % 3];
    squares += from_middle * from_middle;
    for (size_t k = 0; k < codes; ++k) size.slope[k] += from_middle * double(anchors.linear[i * codes + k]);
  }
  for (double& slope : size.slope) slope = squares > 0 ? slope / squares : 0;
  return size;
}

// a^T S a; S is symmetric.
double variance(const std::vector<double>& a, const std::vector<float>& covariance) {
  double sum = 0;
  for (size_t r = 0; r < a.size(); ++r) {
    const float* const row = covariance.data() + r * a.size();
    double of_row = 0;
    for (size_t c = 0; c < a.size(); ++c) of_row += double(row[c]) * a[c];
    sum += a[r] * of_row;
  }
  return sum;
}

}  // namespace

double size_sigma(const HeadPrior& prior) {
  double sum = 0;
  for (const double slope : size_by_codes(prior).slope) sum += slope * slope;
  return std::sqrt(sum);
}

StoredAnchors known_anchors(const HeadPrior& prior, const std::vector<float>& shape,
                            const std::vector<float>& covariance) {
  const SizeByCodes size = size_by_codes(prior);
  const size_t codes = shape.size();
  StoredAnchors stored{prior.anchors.template_points, prior.anchors.mean, prior.anchors.sigma};
  std::vector<double> moves(codes);  // of a coordinate, at one size
  for (size_t i = 0; i < stored.points.size(); ++i) {
    const float* const linear = prior.anchors.linear.data() + i * codes;
    const double from_middle = double(prior.anchors.mean[i]) - size.middle[i % 3];
    double point = double(stored.points[i]);
    for (size_t k = 0; k < codes; ++k) {
      point += double(linear[k] * shape[k]);
      moves[k] = double(linear[k]) - from_middle * size.slope[k];
    }
    stored.points[i] = float(point);
    float& sigma = stored.sigma[i / 3];
    sigma = float(std::sqrt(double(sigma) * double(sigma) + variance(moves, covariance) / 3));
  }
  return stored;
}

}  // namespace maq::head
