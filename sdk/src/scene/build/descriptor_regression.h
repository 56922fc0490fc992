// How a point looks from different sides: the ridge regression of NPBG++ (arXiv 2203.13318, section 3.3), one point at a
// time, view after view.
//
// A view gives a feature y (8 values, from the image) and a basis value h (6 values, from the direction). The look from a
// new direction is y(h) = beta0 + h beta, with beta0 = mean y and beta the solution of
//   (sum h^T h + alpha I) beta = sum h^T y - (sum h)^T beta0.
// The right side is that of centred values. What is kept is the triangle R of a QR decomposition of the centred basis
// values and the features turned with it: R^T R is their scatter, R^T d the right side. Sums of products would square the
// condition of the system, and differences of large sums would leave nothing where all directions are nearly equal; here
// both are as exact as the values themselves, in float, and where all directions are equal R and d stay exactly 0.
#pragma once

#include <cstdint>

namespace maq {

inline constexpr int kFeatures = 8;
inline constexpr int kBasis = 6;

// Of one point; all zero before the first view.
struct ViewMoments {
  uint32_t views;
  float mean_y[kFeatures];
  float mean_h[kBasis];
  float triangle[kBasis * (kBasis + 1) / 2];  // R, row by row, from the diagonal on
  float turned[kBasis][kFeatures];            // d

  void add(const float y[kFeatures], const float h[kBasis]);
};
static_assert(sizeof(ViewMoments) == 336);

enum class LookKind {
  kUnseen,
  kConstant,  // seen once, or always from the same side
  kVarying,
  kSingular,  // alpha = 0, and the directions do not tell: as constant
};

// Writes beta [kBasis][kFeatures], 0 unless the look varies; beta0 is ViewMoments::mean_y.
LookKind solve_look(const ViewMoments& moments, double alpha, float beta[kBasis][kFeatures]);

}  // namespace maq
