#include "edges/curves/surface_patch.h"

#include <algorithm>
#include <cmath>

#include "core/math/small_solve.h"

namespace maq {
namespace {

constexpr double kMinSigma_r = 0.02;  // lower limit: rounding of float depth, surfaces that are not quite flat

void polynomial(double u, double v, int terms, double* out) {
  out[0] = 1, out[1] = u, out[2] = v;
  if (terms == 6) out[3] = u * u, out[4] = u * v, out[5] = v * v;
}

double residual_r(const BandPixel& pixel, const SurfacePatch& patch, double focal_px) {
  return focal_px * (patch.inverse_depth(pixel.x, pixel.y) / pixel.inverse_depth - 1);
}

// Weighted least squares around (x, y).
SurfacePatch solve_patch(const std::vector<BandPixel>& pixels, double x, double y, double focal_px, int terms) {
  SurfacePatch patch;
  if (int(pixels.size()) < 2 * terms) return patch;
  const double unit = pixels[pixels.size() / 2].inverse_depth;
  double a[36] = {}, b[12] = {}, row[6], weight = 0, squares = 0;
  for (const BandPixel& pixel : pixels) {
    polynomial((pixel.x - x) / kPatchScale_px, (pixel.y - y) / kPatchScale_px, terms, row);
    const double value = pixel.inverse_depth / unit - 1, w = pixel.weight;
    for (int i = 0; i < terms; ++i) {
      for (int j = 0; j <= i; ++j) a[i * 6 + j] += w * row[i] * row[j];
      b[2 * i] += w * row[i] * value;
    }
    weight += w;
    squares += w * value * value;
  }
  b[1] = 1;  // a second system: its solution is the variance at the point itself
  double fitted = 0;
  double right[6];
  for (int i = 0; i < terms; ++i) right[i] = b[2 * i];
  if (!(weight > 0) || !solve_positive(a, terms, 6, b, 2)) return patch;
  for (int i = 0; i < terms; ++i) fitted += b[2 * i] * right[i];
  patch.x = x, patch.y = y;
  patch.terms = terms;
  for (int i = 0; i < terms; ++i) patch.coefficient[size_t(i)] = unit * (b[2 * i] + (i == 0 ? 1 : 0));
  patch.rms_footprints = focal_px * std::sqrt(std::max(0.0, squares - fitted) / weight);
  patch.edge_sigma_r = std::max(patch.rms_footprints, kMinSigma_r) * std::sqrt(std::max(0.0, b[1]));
  if (!(patch.coefficient[0] > 0.2 * unit && patch.coefficient[0] < 5 * unit)) patch.terms = 0;
  return patch;
}

}  // namespace

double SurfacePatch::inverse_depth(double at_x, double at_y) const {
  const double u = (at_x - x) / kPatchScale_px, v = (at_y - y) / kPatchScale_px;
  const auto& c = coefficient;
  return c[0] + u * (c[1] + c[3] * u + c[4] * v) + v * (c[2] + c[5] * v);
}

std::array<double, 2> SurfacePatch::slope(double at_x, double at_y) const {
  const double u = (at_x - x) / kPatchScale_px, v = (at_y - y) / kPatchScale_px;
  const auto& c = coefficient;
  return {(c[1] + 2 * c[3] * u + c[4] * v) / kPatchScale_px, (c[2] + c[4] * u + 2 * c[5] * v) / kPatchScale_px};
}

void PlaneSums::begin(double at_x, double at_y, double inverse_depth) {
  *this = PlaneSums();
  x = at_x, y = at_y, unit = inverse_depth;
}

void PlaneSums::add(const BandPixel& pixel) {
  const double u = (pixel.x - x) / kPatchScale_px, v = (pixel.y - y) / kPatchScale_px, w = pixel.weight;
  const double value = pixel.inverse_depth / unit - 1;
  a[0] += w, a[1] += w * u, a[2] += w * v, a[3] += w * u * u, a[4] += w * u * v, a[5] += w * v * v;
  b[0] += w * value, b[1] += w * u * value, b[2] += w * v * value;
  squares += w * value * value;
  weight += w;
}

void PlaneSums::add(const PlaneSums& other) {
  if (weight == 0) {
    *this = other;
    return;
  }
  // value = other_value * scale + shift, in this one's unit
  const double scale = other.unit / unit, shift = scale - 1;
  for (size_t i = 0; i < a.size(); ++i) a[i] += other.a[i];
  for (size_t i = 0; i < b.size(); ++i) b[i] += scale * other.b[i] + shift * other.a[i];
  squares += scale * scale * other.squares + 2 * scale * shift * other.b[0] + shift * shift * other.a[0];
  weight += other.weight;
}

SurfacePatch PlaneSums::solve(double focal_px, double edge_x, double edge_y) const {
  SurfacePatch patch;
  double matrix[9] = {a[0], 0, 0, a[1], a[3], 0, a[2], a[4], a[5]};
  const double u = (edge_x - x) / kPatchScale_px, v = (edge_y - y) / kPatchScale_px;
  double right[6] = {b[0], 1, b[1], u, b[2], v};
  if (!(weight >= 6) || !solve_positive(matrix, 3, 3, right, 2)) return patch;
  patch.x = x, patch.y = y;
  patch.terms = 3;
  for (size_t i = 0; i < 3; ++i) patch.coefficient[i] = unit * (right[2 * i] + (i == 0 ? 1 : 0));
  const double fitted = right[0] * b[0] + right[2] * b[1] + right[4] * b[2];
  patch.rms_footprints = focal_px * std::sqrt(std::max(0.0, squares - fitted) / weight);
  const double variance = right[1] + u * right[3] + v * right[5];
  patch.edge_sigma_r = std::max(patch.rms_footprints, kMinSigma_r) * std::sqrt(std::max(0.0, variance));
  return patch;
}

double PatchFitter::scale_of_residuals(const std::vector<BandPixel>& pixels, const SurfacePatch& patch,
                                       double focal_px) {
  residuals_.clear();
  for (const BandPixel& pixel : pixels) residuals_.push_back(std::abs(residual_r(pixel, patch, focal_px)));
  const auto middle = residuals_.begin() + std::ptrdiff_t(residuals_.size() / 2);
  std::nth_element(residuals_.begin(), middle, residuals_.end());
  return std::max(1.4826 * *middle, kMinSigma_r);
}

SurfacePatch PatchFitter::fit(std::vector<BandPixel>& pixels, double x, double y, double focal_px, bool may_bend) {
  for (BandPixel& pixel : pixels) pixel.weight = 1;
  SurfacePatch best;
  for (const int terms : {3, 6}) {
    SurfacePatch patch = solve_patch(pixels, x, y, focal_px, terms);
    for (int round = 0; round < 3 && patch.terms != 0; ++round) {
      const double scale = 2 * scale_of_residuals(pixels, patch, focal_px);
      if (scale <= 2 * kMinSigma_r && patch.rms_footprints <= kMinSigma_r) break;
      for (BandPixel& pixel : pixels) {
        const double ratio = residual_r(pixel, patch, focal_px) / scale;
        pixel.weight = 1 / ((1 + ratio * ratio) * (1 + ratio * ratio));
      }
      patch = solve_patch(pixels, x, y, focal_px, terms);
    }
    if (terms == 3) {
      best = patch;
      // The surface is flat within its noise, or the pixels determine only a plane.
      if (!may_bend || (best.terms != 0 && best.rms_footprints < 2 * kMinSigma_r)) break;
    } else if (patch.terms != 0 && (best.terms == 0 || patch.rms_footprints < 0.5 * best.rms_footprints)) {
      best = patch;
    }
  }
  return best;
}

Plane plane_of(const SurfacePatch& patch, const Intrinsics& camera) {
  // 1/z = q0 + qx (px - x) + qy (py - y), times z, with px = fx X/z + cx: 1 = a X + b Y + c z.
  const double qx = patch.coefficient[1] / kPatchScale_px, qy = patch.coefficient[2] / kPatchScale_px;
  const Vec3 n{qx * camera.fx_px, qy * camera.fy_px,
               patch.coefficient[0] + qx * (camera.cx_px - patch.x) + qy * (camera.cy_px - patch.y)};
  const double size = length(n);
  return {(-1 / size) * n, -1 / size};
}

}  // namespace maq
