#include "edges/curves/arc_fit.h"

#include <algorithm>

#include "core/math/small_solve.h"

namespace maq {
namespace {

constexpr double kTwoPi = 6.283185307179586;
constexpr double kMinHeight = 3;       // of an arc over its chord, in the root mean square of its points' distances
constexpr double kLargestRadius = 60;  // over its visible length: 1 degree is a line

}  // namespace

std::optional<ArcFit> ArcFitter::fit(const FitPoint* points, size_t count) {
  if (count < 4) return {};
  const Vec3 origin = points[0].point;
  double sum = 0;
  Vec3 mean;
  for (size_t i = 0; i < count; ++i) {
    const double w = points[i].weight / (points[i].unit_m * points[i].unit_m);
    mean = mean + w * (points[i].point - origin);
    sum += w;
  }
  if (!(sum > 0) || !is_finite(mean)) return {};
  mean = (1 / sum) * mean;
  std::array<double, 6> m{};
  for (size_t i = 0; i < count; ++i) {
    const double w = points[i].weight / (points[i].unit_m * points[i].unit_m) / sum;
    const Vec3 d = points[i].point - origin - mean;
    m[0] += w * d.x * d.x, m[1] += w * d.x * d.y, m[2] += w * d.x * d.z;
    m[3] += w * d.y * d.y, m[4] += w * d.y * d.z, m[5] += w * d.z * d.z;
  }
  const Vec3 middle = origin + mean;
  const PrincipalAxes axes = principal_axes(m);
  const double rounding = std::pow(kFitRounding * length(middle), 2);
  // Points on one line have no plane.
  if (!(axes.variance[1] > rounding) || !(axes.variance[1] > 4 * axes.variance[2])) return {};
  Vec3 normal = axes.axis[2];
  if (dot(normal, middle) > 0) normal = -normal;
  const Vec3 ex = axes.axis[0], ey = cross(normal, ex);
  const double size = std::sqrt(axes.variance[0]);
  flat_.clear();
  double off_plane = 0, weights = 0, least = INFINITY, most = -INFINITY, unit_sum = 0;
  for (size_t i = 0; i < count; ++i) {
    const Vec3 d = points[i].point - middle;
    const double unit = points[i].unit_m / size, x = dot(d, ex) / size, off = dot(d, normal) / points[i].unit_m;
    flat_.push_back({x, dot(d, ey) / size, unit, points[i].weight});
    off_plane += points[i].weight * off * off, weights += points[i].weight;
    unit_sum += points[i].weight * unit;
    least = std::min(least, x), most = std::max(most, x);
  }

  // Start: x^2 + y^2 = 2 a x + 2 b y + c, linear in a, b, c.
  double matrix[9] = {}, right[3] = {};
  for (const Flat& p : flat_) {
    const double row[3] = {2 * p.x, 2 * p.y, 1}, value = p.x * p.x + p.y * p.y;
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j <= i; ++j) matrix[i * 3 + j] += p.weight * row[i] * row[j];
      right[i] += p.weight * row[i] * value;
    }
  }
  if (!solve_positive(matrix, 3, 3, right, 1)) return {};
  double cx = right[0], cy = right[1], radius = std::sqrt(std::max(0.0, right[2] + cx * cx + cy * cy));
  double rms = 0;
  for (int round = 0; round < 12; ++round) {
    if (!(radius < kLargestRadius * (most - least)) || !(radius > 0)) return {};
    double a[9] = {}, b[3] = {}, squares = 0;
    for (const Flat& p : flat_) {
      const double dx = p.x - cx, dy = p.y - cy, distance = std::hypot(dx, dy);
      const double off = distance - radius, scaled = off / p.unit;
      squares += p.weight * scaled * scaled;
      if (!(distance > 1e-9)) continue;
      const double ratio = round > 0 && rms > 0 ? scaled / (2 * rms) : 0;
      const double w = p.weight / (p.unit * p.unit) / (1 + ratio * ratio);
      const double row[3] = {dx / distance, dy / distance, 1};
      for (int i = 0; i < 3; ++i) {
        for (int j = 0; j <= i; ++j) a[i * 3 + j] += w * row[i] * row[j];
        b[i] += w * row[i] * off;
      }
    }
    rms = std::sqrt(squares / weights);
    if (round == 11 || !solve_positive(a, 3, 3, b, 1)) break;
    cx += b[0], cy += b[1], radius += b[2];
    if (std::abs(b[0]) + std::abs(b[1]) + std::abs(b[2]) < 1e-12 * radius && round < 10) round = 10;
  }
  if (!std::isfinite(cx + cy + radius)) return {};

  angles_.clear();
  for (const Flat& p : flat_) angles_.push_back(std::atan2(p.y - cy, p.x - cx));
  std::sort(angles_.begin(), angles_.end());
  double gap = angles_.front() + kTwoPi - angles_.back(), start = angles_.front();
  for (size_t i = 1; i < angles_.size(); ++i) {
    if (angles_[i] - angles_[i - 1] <= gap) continue;
    gap = angles_[i] - angles_[i - 1];
    start = angles_[i];
  }
  ArcFit fit;
  fit.rms = std::sqrt(rms * rms + off_plane / weights);
  fit.sweep_rad = kTwoPi - gap;
  fit.is_closed = count >= 8 && gap < 3 * fit.sweep_rad / double(count - 1);
  if (fit.is_closed) fit.sweep_rad = kTwoPi;
  const double height = radius * (1 - std::cos(std::min(fit.sweep_rad, kTwoPi / 2) / 2));
  if (!(height > kMinHeight * fit.rms * unit_sum / weights)) return {};
  fit.centre = middle + size * (cx * ex + cy * ey);
  const Vec3 x = std::cos(start) * ex + std::sin(start) * ey;
  fit.x_axis = radius * size * x;
  fit.y_axis = radius * size * cross(normal, x);
  return fit;
}

}  // namespace maq
