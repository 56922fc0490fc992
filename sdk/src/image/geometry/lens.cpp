#include "image/geometry/lens.h"

#include <cmath>
#include <limits>

#include "core/simd_clones.h"

namespace maq {
namespace {

constexpr double kMaxAngle = 60 * 3.14159265358979323846 / 180;

// Returns the factor for the distance from the axis, a tangent; `r2` is its square.
double radial_factor(const Lens& lens, double r2) {
  const auto& k = lens.coefficients;
  if (lens.distortion == Distortion::kFisheye) {
    const double radius = std::sqrt(r2);
    const double angle = std::atan(radius), a2 = angle * angle;
    const double bent = angle * (1 + a2 * (k[0] + a2 * (k[1] + a2 * (k[2] + a2 * k[3]))));
    return radius > 1e-8 ? bent / radius : 1;
  }
  return (1 + r2 * (k[0] + r2 * (k[1] + r2 * k[4]))) / (1 + r2 * (k[5] + r2 * (k[6] + r2 * k[7])));
}

// The distance from the axis up to which the distorted distance grows with it.
double max_radius_of(const Lens& lens) {
  if (lens.distortion == Distortion::kNone) return std::numeric_limits<double>::infinity();
  constexpr int kSteps = 2000;
  double max_radius = 0, at = 0;
  for (int i = 1; i <= kSteps; ++i) {
    const double radius = std::tan(kMaxAngle * i / kSteps);
    const double next = radius * radial_factor(lens, radius * radius);
    if (!(next > at) || !std::isfinite(next)) break;
    at = next;
    max_radius = radius;
  }
  return max_radius;
}

// find() for the rational model, in a loop that compilers make vectors of.
MAQ_SIMD_CLONES void find_row_rational(const Lens& lens, double max_radius2, const double* x, double y, size_t count,
                                       double* column_px, double* row_px) {
  const double fx = lens.fx_px, fy = lens.fy_px, cx = lens.cx_px, cy = lens.cy_px;
  const double k1 = lens.coefficients[0], k2 = lens.coefficients[1], p1 = lens.coefficients[2],
               p2 = lens.coefficients[3], k3 = lens.coefficients[4], k4 = lens.coefficients[5],
               k5 = lens.coefficients[6], k6 = lens.coefficients[7];
  constexpr double kNowhere = std::numeric_limits<double>::quiet_NaN();
  for (size_t i = 0; i < count; ++i) {
    const double r2 = x[i] * x[i] + y * y;
    const double factor = (1 + r2 * (k1 + r2 * (k2 + r2 * k3))) / (1 + r2 * (k4 + r2 * (k5 + r2 * k6)));
    const double column = x[i] * factor + (2 * p1 * x[i] * y + p2 * (r2 + 2 * x[i] * x[i]));
    const double row = y * factor + (p1 * (r2 + 2 * y * y) + 2 * p2 * x[i] * y);
    column_px[i] = r2 <= max_radius2 ? column * fx + cx : kNowhere;
    row_px[i] = r2 <= max_radius2 ? row * fy + cy : kNowhere;
  }
}

Lens with_focal_lengths_times(const Lens& lens, double factor) {
  Lens made = lens;
  made.distortion = Distortion::kNone;
  made.coefficients = {};
  made.fx_px *= factor;
  made.fy_px *= factor;
  return made;
}

// Returns whether all pixels on the border of an undistorted image, and so all pixels, come from the distorted one.
bool is_filled(const Lens& lens, const LensProjection& projection, const Lens& undistorted) {
  const auto has_source = [&](int column, int row) {
    const auto at = projection.find((column - undistorted.cx_px) / undistorted.fx_px,
                                    (row - undistorted.cy_px) / undistorted.fy_px);
    return at && at->column_px >= -0.5 && at->column_px <= lens.width_px - 0.5 && at->row_px >= -0.5 &&
           at->row_px <= lens.height_px - 0.5;
  };
  const int right = undistorted.width_px - 1, bottom = undistorted.height_px - 1;
  for (int column = 0; column <= right; ++column) {
    if (!has_source(column, 0) || !has_source(column, bottom)) return false;
  }
  for (int row = 0; row <= bottom; ++row) {
    if (!has_source(0, row) || !has_source(right, row)) return false;
  }
  return true;
}

}  // namespace

LensProjection::LensProjection(const Lens& lens) : lens_(lens), max_radius_(max_radius_of(lens)) {}

std::optional<PixelPosition> LensProjection::find(double x, double y) const {
  const double r2 = x * x + y * y;
  if (!(r2 <= max_radius_ * max_radius_)) return {};
  double column = x, row = y;
  if (lens_.distortion != Distortion::kNone) {
    const double factor = radial_factor(lens_, r2);
    column *= factor;
    row *= factor;
  }
  if (lens_.distortion == Distortion::kRational) {
    const double p1 = lens_.coefficients[2], p2 = lens_.coefficients[3];
    column += 2 * p1 * x * y + p2 * (r2 + 2 * x * x);
    row += p1 * (r2 + 2 * y * y) + 2 * p2 * x * y;
  }
  return PixelPosition{column * lens_.fx_px + lens_.cx_px, row * lens_.fy_px + lens_.cy_px};
}

void LensProjection::find_row(const std::vector<double>& x, double y, double* column_px, double* row_px) const {
  if (lens_.distortion == Distortion::kRational) {
    return find_row_rational(lens_, max_radius_ * max_radius_, x.data(), y, x.size(), column_px, row_px);
  }
  constexpr double kNowhere = std::numeric_limits<double>::quiet_NaN();
  for (size_t i = 0; i < x.size(); ++i) {
    const PixelPosition at = find(x[i], y).value_or(PixelPosition{kNowhere, kNowhere});
    column_px[i] = at.column_px;
    row_px[i] = at.row_px;
  }
}

std::optional<Lens> without_distortion(const Lens& lens) {
  if (lens.distortion == Distortion::kNone) return lens;
  const LensProjection projection(lens);
  const auto is_enough = [&](double factor) {
    return is_filled(lens, projection, with_focal_lengths_times(lens, factor));
  };
  constexpr double kMin = 1.0 / 16, kMax = 16;
  double enough = 1;
  while (!is_enough(enough)) {
    enough *= 2;
    if (enough > kMax) return {};
  }
  double short_of = enough / 2;
  while (short_of >= kMin && is_enough(short_of)) {
    enough = short_of;
    short_of /= 2;
  }
  // A narrower image around the axis is a part of the wider one, so that bisection finds the smallest factor.
  for (int i = 0; i < 30; ++i) {
    const double middle = (enough + short_of) / 2;
    (is_enough(middle) ? enough : short_of) = middle;
  }
  return with_focal_lengths_times(lens, enough);
}

}  // namespace maq
