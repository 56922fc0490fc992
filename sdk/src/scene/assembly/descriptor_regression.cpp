#include "scene/assembly/descriptor_regression.h"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace maq {
namespace {

// A diagonal element below this fraction of the largest is rounding: the directions do not span the basis.
constexpr double kMinDiagonal = 1e-12;

// Rotates a row of the system (values of the basis, of the features) into R and Q^T y, one Givens rotation for each row
// of R, after which the row's values of the basis are 0.
template <class Value>
void givens_rotate(Value* triangle, Value (*rotated)[kFeatures], Value* row, Value* features) {
  Value* diagonal = triangle;
  for (int i = 0; i < kBasis; diagonal += kBasis - i, ++i) {
    const Value length = std::sqrt(diagonal[0] * diagonal[0] + row[i] * row[i]);
    if (row[i] == 0 || length == 0) continue;
    // With 1 - cosine instead of cosine, which is nearly 1 after many rows and would be rounded the same way each time.
    const Value sine = row[i] / length, less = row[i] * sine / (length + diagonal[0]);
    diagonal[0] += row[i] * row[i] / (length + diagonal[0]);
    for (int j = i + 1; j < kBasis; ++j) {
      const Value kept = diagonal[j - i];
      diagonal[j - i] += sine * row[j] - less * kept;
      row[j] -= less * row[j] + sine * kept;
    }
    for (int c = 0; c < kFeatures; ++c) {
      const Value kept = rotated[i][c];
      rotated[i][c] += sine * features[c] - less * kept;
      features[c] -= less * features[c] + sine * kept;
    }
  }
}

}  // namespace

void DescriptorRegression::add(const float y[kFeatures], const float h[kBasis]) {
  ++views;
  const float fraction = 1.0f / float(views);
  const float root = std::sqrt(float(views - 1) * fraction);  // the scatter grows by (K - 1) / K of the products
  float dy[kFeatures], dh[kBasis];
  for (int c = 0; c < kFeatures; ++c) {
    const float off = y[c] - mean_y[c];
    mean_y[c] += off * fraction;
    dy[c] = root * off;
  }
  for (int i = 0; i < kBasis; ++i) {
    const float off = h[i] - mean_h[i];
    mean_h[i] += off * fraction;
    dh[i] = root * off;
  }
  givens_rotate(triangle, rotated, dh, dy);
}

DescriptorKind solve_descriptor(const DescriptorRegression& regression, double alpha, float beta[kBasis][kFeatures]) {
  std::memset(beta, 0, sizeof(float) * kBasis * kFeatures);
  if (regression.views == 0) return DescriptorKind::kUnseen;
  double triangle[kBasis * (kBasis + 1) / 2], rotated[kBasis][kFeatures];
  bool is_constant = true;
  for (int i = 0; i < kBasis * (kBasis + 1) / 2; ++i) {
    triangle[i] = regression.triangle[i];
    is_constant = is_constant && triangle[i] == 0;
  }
  if (is_constant) return DescriptorKind::kConstant;
  for (int i = 0; i < kBasis; ++i) {
    for (int c = 0; c < kFeatures; ++c) rotated[i][c] = regression.rotated[i][c];
  }

  // The part that the centred values leave out, and the regulariser, as rows with features of 0.
  for (int extra = -1; extra < kBasis; ++extra) {
    double row[kBasis] = {}, features[kFeatures] = {};
    if (extra >= 0) {
      row[extra] = std::sqrt(alpha);
    } else {
      for (int i = 0; i < kBasis; ++i) row[i] = std::sqrt(double(regression.views)) * regression.mean_h[i];
    }
    givens_rotate(triangle, rotated, row, features);
  }

  const double* diagonals[kBasis];
  double largest = 0;
  const double* diagonal = triangle;
  for (int i = 0; i < kBasis; diagonal += kBasis - i, ++i) {
    diagonals[i] = diagonal;
    largest = std::max(largest, std::abs(*diagonal));
  }
  double solution[kBasis][kFeatures];
  for (int i = kBasis - 1; i >= 0; --i) {
    if (!(std::abs(*diagonals[i]) > kMinDiagonal * largest)) return DescriptorKind::kSingular;
    for (int c = 0; c < kFeatures; ++c) {
      double value = rotated[i][c];
      for (int j = i + 1; j < kBasis; ++j) value -= diagonals[i][j - i] * solution[j][c];
      solution[i][c] = value / *diagonals[i];
      if (!std::isfinite(float(solution[i][c]))) return DescriptorKind::kSingular;
    }
  }
  for (int i = 0; i < kBasis; ++i) {
    for (int c = 0; c < kFeatures; ++c) beta[i][c] = float(solution[i][c]);
  }
  return DescriptorKind::kViewDependent;
}

}  // namespace maq
