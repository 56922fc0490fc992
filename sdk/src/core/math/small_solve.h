// Dense systems of a handful of unknowns, without a library: the fits of all systems need nothing else of linear
// algebra.
#pragma once

#include <array>
#include <cmath>
#include <utility>

#include "core/math/vec3.h"

namespace maq {

// Solves A x = b in place for the symmetric positive definite A of `size` rows at `stride`, by Cholesky: b becomes x
// (`columns` right-hand sides, row by row), the lower triangle of A its factor. False, with b not to be used, where a
// pivot is below 1e-12 of its diagonal element: the equations do not determine x.
inline bool solve_positive(double* a, int size, int stride, double* b, int columns) {
  for (int i = 0; i < size; ++i) {
    for (int j = 0; j <= i; ++j) {
      double sum = a[i * stride + j];
      for (int k = 0; k < j; ++k) sum -= a[i * stride + k] * a[j * stride + k];
      if (i != j) {
        a[i * stride + j] = sum / a[j * stride + j];
      } else if (sum > 1e-12 * a[i * stride + i] && std::isfinite(sum)) {
        a[i * stride + i] = std::sqrt(sum);
      } else {
        return false;
      }
    }
  }
  for (int c = 0; c < columns; ++c) {
    for (int i = 0; i < size; ++i) {
      for (int k = 0; k < i; ++k) b[i * columns + c] -= a[i * stride + k] * b[k * columns + c];
      b[i * columns + c] /= a[i * stride + i];
    }
    for (int i = size - 1; i >= 0; --i) {
      for (int k = i + 1; k < size; ++k) b[i * columns + c] -= a[k * stride + i] * b[k * columns + c];
      b[i * columns + c] /= a[i * stride + i];
    }
  }
  return true;
}

struct PrincipalAxes {
  std::array<double, 3> variance;  // falling
  std::array<Vec3, 3> axis;
};

// Decomposes a symmetric 3x3 matrix (xx, xy, xz, yy, yz, zz), by Jacobi rotations.
inline PrincipalAxes principal_axes(const std::array<double, 6>& m) {
  double a[3][3] = {{m[0], m[1], m[2]}, {m[1], m[3], m[4]}, {m[2], m[4], m[5]}};
  double v[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  for (int sweep = 0; sweep < 12; ++sweep) {
    for (int p = 0; p < 2; ++p) {
      for (int q = p + 1; q < 3; ++q) {
        if (!(std::abs(a[p][q]) > 1e-300)) continue;
        const double ratio = (a[q][q] - a[p][p]) / (2 * a[p][q]);
        const double t = std::copysign(1 / (std::abs(ratio) + std::sqrt(ratio * ratio + 1)), ratio);
        const double c = 1 / std::sqrt(t * t + 1), s = t * c;
        for (int k = 0; k < 3; ++k) {
          const double kp = a[k][p], kq = a[k][q];
          a[k][p] = c * kp - s * kq;
          a[k][q] = s * kp + c * kq;
        }
        for (int k = 0; k < 3; ++k) {
          const double pk = a[p][k], qk = a[q][k];
          a[p][k] = c * pk - s * qk;
          a[q][k] = s * pk + c * qk;
        }
        for (auto& row : v) {
          const double kp = row[p], kq = row[q];
          row[p] = c * kp - s * kq;
          row[q] = s * kp + c * kq;
        }
      }
    }
  }
  int order[3] = {0, 1, 2};
  if (a[order[0]][order[0]] < a[order[1]][order[1]]) std::swap(order[0], order[1]);
  if (a[order[1]][order[1]] < a[order[2]][order[2]]) std::swap(order[1], order[2]);
  if (a[order[0]][order[0]] < a[order[1]][order[1]]) std::swap(order[0], order[1]);
  PrincipalAxes found;
  for (int i = 0; i < 3; ++i) {
    const int k = order[i];
    found.variance[size_t(i)] = a[k][k];
    found.axis[size_t(i)] = {v[0][k], v[1][k], v[2][k]};
  }
  return found;
}

}  // namespace maq
