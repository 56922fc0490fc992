#include "edges/curves/line_fit.h"

#include <algorithm>

#include "core/math/small_solve.h"

namespace maq {

std::optional<LineFit> fit_line(const FitPoint* points, size_t count) {
  if (count < 2) return {};
  LineFit fit;
  Vec3 direction;
  double scale = INFINITY;  // of the robust weight, units
  for (int round = 0; round < 3; ++round) {
    // Around the first point, or coordinates of a kilometre would eat the digits of a millimetre.
    const Vec3 origin = points[0].point;
    const auto weight_of = [&](const FitPoint& p) {
      double w = p.weight / (p.unit_m * p.unit_m);
      if (round > 0) {
        const double off = length(cross(p.point - fit.from, direction)) / p.unit_m / scale;
        w /= 1 + off * off;
      }
      return w;
    };
    double sum = 0;
    Vec3 mean;
    for (size_t i = 0; i < count; ++i) {
      const double w = weight_of(points[i]);
      mean = mean + w * (points[i].point - origin);
      sum += w;
    }
    if (!(sum > 0) || !is_finite(mean)) return {};
    mean = (1 / sum) * mean;
    std::array<double, 6> m{};
    for (size_t i = 0; i < count; ++i) {
      const double w = weight_of(points[i]) / sum;
      const Vec3 d = points[i].point - origin - mean;
      m[0] += w * d.x * d.x, m[1] += w * d.x * d.y, m[2] += w * d.x * d.z;
      m[3] += w * d.y * d.y, m[4] += w * d.y * d.z, m[5] += w * d.z * d.z;
    }
    const PrincipalAxes axes = principal_axes(m);
    if (!(axes.variance[0] > std::pow(kFitRounding * length(origin + mean), 2))) return {};
    direction = axes.axis[0];
    if (dot(direction, points[count - 1].point - points[0].point) < 0) direction = -direction;
    double least = INFINITY, most = -INFINITY, squares = 0, weights = 0;
    const Vec3 centre = origin + mean;
    for (size_t i = 0; i < count; ++i) {
      const Vec3 d = points[i].point - centre;
      least = std::min(least, dot(d, direction)), most = std::max(most, dot(d, direction));
      const double off = length(cross(d, direction)) / points[i].unit_m;
      squares += points[i].weight * off * off, weights += points[i].weight;
    }
    fit.from = centre + least * direction;
    fit.to = centre + most * direction;
    fit.rms = std::sqrt(squares / weights);
    scale = 2 * fit.rms;
    if (!(scale > 1e-9)) break;
  }
  return fit;
}

}  // namespace maq
