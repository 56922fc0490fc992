#include "scene/capture/posed_photo.h"

#include <algorithm>
#include <cmath>

#include "maquette/frame.h"

namespace maq {
namespace {

template <class Range>
bool all_finite(const Range& values) {
  return std::all_of(std::begin(values), std::end(values), [](double value) { return std::isfinite(value); });
}

double dot(const double* a, const double* b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

}  // namespace

const char* fault_of(const Lens& lens) {
  if (!all_finite(std::array<double, 4>{lens.fx_px, lens.fy_px, lens.cx_px, lens.cy_px}) ||
      !all_finite(lens.coefficients)) {
    return "photos whose camera has numbers that are not finite";
  }
  if (!(lens.fx_px > 0 && lens.fy_px > 0)) return "photos whose camera has no positive focal length";
  if (lens.width_px < 1 || lens.height_px < 1 || lens.width_px > MAQ_MAX_SIDE_PX || lens.height_px > MAQ_MAX_SIDE_PX) {
    return "photos whose camera has no size, or one over the limit";
  }
  return nullptr;
}

const char* fault_of_pose(const PosedPhoto& photo) {
  // Beyond that, squares of distances are no floats any more.
  constexpr double kFarthest = 1e15;
  const auto& c = photo.centre;
  if (!all_finite(photo.rotation) || !all_finite(c) ||
      std::max({std::abs(c[0]), std::abs(c[1]), std::abs(c[2])}) > kFarthest) {
    return "photos whose pose is not finite";
  }
  std::array<double, 9> rotation = photo.rotation;
  if (!make_exact_rotation(rotation)) return "photos whose rotation is not of length 1, or mirrors";
  return nullptr;
}

bool make_exact_rotation(std::array<double, 9>& rotation) {
  constexpr double kTolerance = 0.01;
  std::array<double, 9> r = rotation;
  for (size_t i = 0; i < 3; ++i) {
    for (size_t j = i; j < 3; ++j) {
      const double expected = i == j ? 1 : 0;
      if (!(std::abs(dot(&r[3 * i], &r[3 * j]) - expected) <= 2 * kTolerance)) return false;
    }
  }
  for (size_t i = 0; i < 2; ++i) {
    if (i == 1) {
      const double along = dot(&r[0], &r[3]);
      for (size_t k = 0; k < 3; ++k) r[3 + k] -= along * r[k];
    }
    const double length = std::sqrt(dot(&r[3 * i], &r[3 * i]));
    for (size_t k = 0; k < 3; ++k) r[3 * i + k] /= length;
  }
  const double third[3] = {r[1] * r[5] - r[2] * r[4], r[2] * r[3] - r[0] * r[5], r[0] * r[4] - r[1] * r[3]};
  if (dot(third, &r[6]) < 0) return false;
  std::copy(third, third + 3, &r[6]);
  rotation = r;
  return true;
}

}  // namespace maq
