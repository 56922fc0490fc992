// The view-dependent descriptor of a point: the ridge regression of NPBG++ (arXiv 2203.13318, section 3.3), one point
// at a time, view after view.
//
// A view gives a feature y (8 values, from the image) and a basis value h (6 values, from the direction). The
// descriptor for a new direction is y(h) = beta0 + h beta, with beta0 = mean y and beta the solution of
// (sum h^T h + alpha I) beta = sum h^T y - (sum h)^T beta0. The right side is that of centred values. The stored state
// is the triangle R of a QR decomposition of the centred basis values and d = Q^T y of the features: R^T R is their
// scatter, R^T d the right side. It is updated row by row by Givens rotations (Golub, Van Loan, "Matrix Computations",
// sections 5.1.8 and 6.5.3). Sums of products would square the condition of the system, and differences of large sums
// would leave nothing where all directions are nearly equal; here both are as exact as the values themselves, in float,
// and where all directions are equal R and d stay exactly 0.
#pragma once

#include <cstdint>

#include "scene/descriptor.h"

namespace maq {

// The regression of one point; all zero before the first view.
struct DescriptorRegression {
  uint32_t views;
  float mean_y[kFeatures];
  float mean_h[kBasis];
  float triangle[kBasis * (kBasis + 1) / 2];  // R, row by row, from the diagonal on
  float rotated[kBasis][kFeatures];           // d

  void add(const float y[kFeatures], const float h[kBasis]);
};
static_assert(sizeof(DescriptorRegression) == 336);

enum class DescriptorKind {
  kUnseen,
  kConstant,  // seen once, or always from one direction
  kViewDependent,
  kSingular,  // alpha = 0, and the directions do not span the basis: as constant
};

// Writes beta [kBasis][kFeatures], 0 unless view-dependent; beta0 is DescriptorRegression::mean_y.
DescriptorKind solve_descriptor(const DescriptorRegression& regression, double alpha, float beta[kBasis][kFeatures]);

}  // namespace maq
