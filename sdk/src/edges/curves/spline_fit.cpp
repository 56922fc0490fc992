#include "edges/curves/spline_fit.h"

#include <algorithm>
#include <array>

#include "core/math/small_solve.h"

namespace maq {
namespace {

constexpr double kStiffness =
    1e-4;  // weight of second differences of control points, which keeps them between the points

struct Basis {
  int first;
  std::array<double, 4> value, slope;  // slope: by t
};

// The four cubic basis functions that are not 0 at t, by Cox and de Boor.
Basis basis_at(int count, double t) {
  const int spans = count - 3;
  const double u = std::clamp(t, 0.0, 1.0) * spans;
  const int span = std::min(int(u), spans - 1);
  const auto knot = [&](int i) { return double(std::clamp(i - 3, 0, spans)); };
  std::array<double, 4> n{1, 0, 0, 0}, below{};
  const int k = span + 3;
  for (int degree = 1; degree <= 3; ++degree) {
    if (degree == 3) below = n;
    double saved = 0;
    for (int i = 0; i < degree; ++i) {
      const double low = knot(k + 1 + i - degree), high = knot(k + 1 + i);
      const double part = n[size_t(i)] / (high - low);
      n[size_t(i)] = saved + (high - u) * part;
      saved = (u - low) * part;
    }
    n[size_t(degree)] = saved;
  }
  Basis basis{span, n, {}};
  for (int i = 0; i < 4; ++i) {
    const int at = span + i;
    double slope = 0;
    if (i > 0) slope += 3 * below[size_t(i) - 1] / (knot(at + 3) - knot(at));
    if (i < 3) slope -= 3 * below[size_t(i)] / (knot(at + 4) - knot(at + 1));
    basis.slope[size_t(i)] = slope * spans;
  }
  return basis;
}

Vec3 weighted(const Vec3* controls, const Basis& basis, const std::array<double, 4>& by) {
  Vec3 sum;
  for (int i = 0; i < 4; ++i) sum = sum + by[size_t(i)] * controls[basis.first + i];
  return sum;
}

}  // namespace

Vec3 spline_point(const Vec3* controls, int count, double t) {
  const Basis basis = basis_at(count, t);
  return weighted(controls, basis, basis.value);
}

bool SplineFitter::solve(const FitPoint* points, size_t count, int control_count, bool is_closed) {
  constexpr int kStride = kMaxSplineControls;
  double a[kStride * kStride] = {}, b[kStride * 3] = {};
  const int unknowns =
      is_closed ? control_count - 1 : control_count;  // the last control of a closed curve is its first
  if (unknowns < 1) return false;
  const auto add = [&](const int* index, const double* value, int terms, double w, Vec3 target) {
    for (int i = 0; i < terms; ++i) {
      const int row = index[i] % unknowns;
      for (int j = 0; j < terms; ++j) a[row * kStride + index[j] % unknowns] += w * value[i] * value[j];
      b[3 * row] += w * value[i] * target.x;
      b[3 * row + 1] += w * value[i] * target.y;
      b[3 * row + 2] += w * value[i] * target.z;
    }
  };
  const Vec3 origin = points[0].point;
  double total = 0;
  for (size_t i = 0; i < count; ++i) {
    const Basis basis = basis_at(control_count, parameters_[i]);
    const int index[4] = {basis.first, basis.first + 1, basis.first + 2, basis.first + 3};
    const double w = points[i].weight / (points[i].unit_m * points[i].unit_m) / (1 + off_[i] * off_[i]);
    add(index, basis.value.data(), 4, w, points[i].point - origin);
    total += w;
  }
  for (int i = 0; i + 2 < control_count; ++i) {
    const int index[3] = {i, i + 1, i + 2};
    const double second[3] = {1, -2, 1};
    add(index, second, 3, kStiffness * total, Vec3{});
  }
  if (!solve_positive(a, unknowns, kStride, b, 3)) return false;
  controls_.resize(size_t(control_count));
  for (int i = 0; i < control_count; ++i) {
    const int row = i % unknowns;
    controls_[size_t(i)] = origin + Vec3{b[3 * row], b[3 * row + 1], b[3 * row + 2]};
    if (!is_finite(controls_[size_t(i)])) return false;
  }
  return true;
}

std::optional<double> SplineFitter::fit(const FitPoint* points, size_t count, bool is_closed, double tolerance) {
  controls_.clear();
  if (count < 4) return {};
  std::optional<double> best;
  const int most = std::min(kMaxSplineControls, int(count));
  for (int controls = std::min(is_closed ? 7 : 4, most); controls <= most; ++controls) {
    // Parameters follow the length of the chords between points.
    parameters_.assign(count, 0);
    double sum = 0;
    for (size_t i = 1; i < count; ++i) parameters_[i] = sum += length(points[i].point - points[i - 1].point);
    if (is_closed) sum += length(points[0].point - points[count - 1].point);
    if (!(sum > kFitRounding * length(points[0].point)) || !std::isfinite(sum)) return {};
    for (double& t : parameters_) t /= sum;
    double rms = 0;
    off_.assign(count, 0);
    for (int round = 0; round < 3; ++round) {
      if (!solve(points, count, controls, is_closed)) return {};
      double squares = 0, weights = 0;
      for (size_t i = 0; i < count; ++i) {
        const Basis basis = basis_at(controls, parameters_[i]);
        const Vec3 off = points[i].point - weighted(controls_.data(), basis, basis.value);
        const Vec3 slope = weighted(controls_.data(), basis, basis.slope);
        const double along = dot(off, slope) / std::max(dot(slope, slope), 1e-300);
        const Vec3 across = off - along * slope;
        off_[i] = length(across) / points[i].unit_m;
        squares += points[i].weight * off_[i] * off_[i];
        weights += points[i].weight;
        // The first and the last point stay the ends.
        if (i > 0 && i + 1 < count)
          parameters_[i] = std::clamp(parameters_[i] + std::clamp(along, -0.02, 0.02), 0.0, 1.0);
      }
      rms = std::sqrt(squares / weights);
      for (double& off : off_) off = rms > 1e-9 ? off / (2 * rms) : 0;
    }
    best = rms;
    if (rms <= tolerance) break;
  }
  return best;
}

}  // namespace maq
