#include "head/fit/anchor_terms.h"

#include <algorithm>
#include <cmath>

#include "core/simd_clones.h"

namespace maq::head {
namespace {

constexpr double kInlierError = 13.8;  // squared sigmas of two coordinates: 99.9 %

// Adds rows' rows [count][size] to the lower triangle of `sum` [size][size]. Four rows at once, so that each element of
// the sum is loaded a quarter as often.
MAQ_SIMD_CLONES void add_squares(const double* rows, size_t count, size_t size, double* sum) {
  size_t r = 0;
  for (; r + 4 <= count; r += 4) {
    const double *a = rows + r * size, *b = a + size, *c = b + size, *d = c + size;
    for (size_t i = 0; i < size; ++i) {
      const double ai = a[i], bi = b[i], ci = c[i], di = d[i];
      double* to = sum + i * size;
      for (size_t j = 0; j <= i; ++j) to[j] += (ai * a[j] + bi * b[j]) + (ci * c[j] + di * d[j]);
    }
  }
  for (; r < count; ++r) {
    const double* a = rows + r * size;
    for (size_t i = 0; i < size; ++i) {
      for (size_t j = 0; j <= i; ++j) sum[i * size + j] += a[i] * a[j];
    }
  }
}

double median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + std::ptrdiff_t(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// Whether the second pass shows the same as the cell, away from its border.
bool is_covered(const HeadCell& cell, const HeadObservations& closer, double border_cells) {
  const Point at = closer.photo_to_crop({cell.x_px + 0.5, cell.y_px + 0.5});
  const double scale =
      std::sqrt(closer.crop_to_photo.xx * closer.crop_to_photo.yy - closer.crop_to_photo.xy * closer.crop_to_photo.yx);
  const double cell_px = closer.cell_px / scale;  // of the crop
  const double first = border_cells * cell_px, last = (closer.side - border_cells) * cell_px;
  return at.x >= first && at.x <= last && at.y >= first && at.y <= last;
}

}  // namespace

AnchorTerms::AnchorTerms(const HeadPhoto& photo, const AnchorPoints& points, const AnchorTermOptions& options)
    : codes_(points.codes()),
      cell_weight_(options.cell_weight),
      limit_(options.limit),
      cx_px_(photo.cx_px),
      cy_px_(photo.cy_px) {
  struct Usable {
    const HeadCell& cell;
    AnchorPoints::Place place;
    double pixel_sigma_px;
  };
  std::vector<Usable> usable;
  const auto take = [&](const HeadObservations& pass, const HeadObservations* closer) {
    const double pixel_sigma_px = std::max(options.pixel_sigma * pass.cell_px, 1e-3);
    for (const HeadCell& cell : pass.cells) {
      if (!cell.is_usable || !(cell.matte > options.min_matte)) continue;
      if (closer != nullptr && is_covered(cell, *closer, options.face_border)) continue;
      const AnchorPoints::Place place = points.place(cell.template_point);
      if (place.distance_dm <= options.max_anchor_dm) usable.push_back({cell, place, pixel_sigma_px});
    }
  };
  take(photo.seen, photo.face ? &*photo.face : nullptr);
  if (photo.face) take(*photo.face, nullptr);
  const size_t count = std::min(usable.size(), options.max_cells);
  cells_.reserve(count);
  linear_.resize(count * 3 * codes_);
  for (size_t i = 0; i < count; ++i) {
    const auto& [cell, place, pixel_sigma_px] = usable[i * usable.size() / count];
    double* rows = linear_.data() + i * 3 * codes_;
    points.linear(place, rows);
    double squares = 0;
    for (size_t k = 0; k < 3 * codes_; ++k) squares += rows[k] * rows[k];
    const double sigma_dm = std::hypot(cell.sigma_dm, place.sigma_dm), x = cell.x_px - cx_px_, y = cell.y_px - cy_px_;
    cells_.push_back({place.mean, x, y, sigma_dm, squares / 3, pixel_sigma_px, 0, limit_});
  }
}

std::vector<Correspondence> AnchorTerms::correspondences() const {
  // The head's scale in the image, roughly: the ratio of the spreads of pixels and of points across the line of
  // sight, which are two of three coordinates.
  std::vector<double> xs, ys;
  for (const Cell& cell : cells_) xs.push_back(cell.x_px), ys.push_back(cell.y_px);
  const double x = median(std::move(xs)), y = median(std::move(ys));
  Vec3 middle;
  for (const Cell& cell : cells_) middle = middle + (1 / double(cells_.size())) * cell.mean;
  std::vector<double> pixels, points;
  for (const Cell& cell : cells_) {
    pixels.push_back(std::hypot(cell.x_px - x, cell.y_px - y));
    points.push_back(std::sqrt(2.0 / 3) * length(cell.mean - middle));
  }
  const double spread = median(std::move(points));
  const double scale = spread > 0 ? median(std::move(pixels)) / spread : 0;
  std::vector<Correspondence> result;
  for (const Cell& cell : cells_) {
    const double sigma_dm = std::sqrt(cell.sigma_dm * cell.sigma_dm + cell.code_variance);
    const double sigma_px = std::hypot(cell.pixel_sigma_px, scale * sigma_dm);
    result.push_back({cell.mean, cell.x_px + cx_px_, cell.y_px + cy_px_, sigma_px, cell_weight_});
  }
  return result;
}

Vec3 AnchorTerms::point(size_t cell, const double* codes) const {
  const double* rows = linear_.data() + cell * 3 * codes_;
  double sums[3] = {};
  for (size_t axis = 0; axis < 3; ++axis) {
    for (size_t k = 0; k < codes_; ++k) sums[axis] += rows[axis * codes_ + k] * codes[k];
  }
  return cells_[cell].mean + Vec3{sums[0], sums[1], sums[2]};
}

AnchorTerms::Residual AnchorTerms::residual(size_t index, const ScaledProjection& projection,
                                            const double* codes) const {
  const Cell& cell = cells_[index];
  Residual result{projection.project(point(index, codes)), 0, 0, INFINITY};
  if (!result.at.is_seen()) return result;
  result.x = cell.x_px - result.at.x_px, result.y = cell.y_px - result.at.y_px;
  result.error = (result.x * result.x + result.y * result.y) * cell.inverse_variance;
  return result;
}

void AnchorTerms::set_noise(const ScaledPose& pose, const double* codes, double code_fraction) {
  const ScaledProjection projection(pose);
  for (size_t i = 0; i < cells_.size(); ++i) {
    Cell& cell = cells_[i];
    const double ratio = std::max(projection.project(point(i, codes)).depth_ratio, 0.1);
    const double scale = projection.scale() / ratio, at_px = scale * cell.sigma_dm;
    const double variance = cell.pixel_sigma_px * cell.pixel_sigma_px + at_px * at_px;
    cell.inverse_variance = 1 / variance;
    cell.limit = limit_ * (1 + code_fraction * scale * scale * cell.code_variance / variance);
  }
}

double AnchorTerms::cost(const ScaledPose& pose, const double* codes) const {
  const ScaledProjection projection(pose);
  double sum = 0;
  for (size_t i = 0; i < cells_.size(); ++i) {
    const double error = residual(i, projection, codes).error;
    sum += cell_weight_ * (std::isinf(error) ? cells_[i].limit : error / (1 + error / cells_[i].limit));
  }
  return sum;
}

void AnchorTerms::accumulate(const ScaledPose& pose, const double* codes, double* a, double* b) {
  const ScaledProjection projection(pose);
  const size_t size = size_t(unknowns());
  rows_.resize(2 * cells_.size() * size);
  double* row = rows_.data();
  for (size_t i = 0; i < cells_.size(); ++i) {
    const Residual off = residual(i, projection, codes);
    if (std::isinf(off.error)) continue;
    const PixelJacobian jacobian = projection.jacobian(off.at);
    const double robust = 1 / (1 + off.error / cells_[i].limit);
    const double root = robust * std::sqrt(cell_weight_ * cells_[i].inverse_variance);
    const double* linear = linear_.data() + i * 3 * codes_;
    for (int axis = 0; axis < 2; ++axis, row += size) {
      for (int k = 0; k < kPoseUnknowns; ++k) row[k] = root * jacobian.by_pose[axis][k];
      const Vec3 turned = {jacobian.by_turned[axis][0], jacobian.by_turned[axis][1], jacobian.by_turned[axis][2]};
      const Vec3 by_point = root * (transposed(pose.rotation) * turned);
      double* by_code = row + kPoseUnknowns;
      for (size_t k = 0; k < codes_; ++k) {
        by_code[k] = by_point.x * linear[k] + by_point.y * linear[codes_ + k] + by_point.z * linear[2 * codes_ + k];
      }
      const double off_px = root * (axis == 0 ? off.x : off.y);
      for (size_t k = 0; k < size; ++k) b[k] += off_px * row[k];
    }
  }
  add_squares(rows_.data(), size_t(row - rows_.data()) / size, size, a);
}

double AnchorTerms::gradient(const ScaledPose& pose, const double* codes, double weight, double* by_pose,
                             double* by_codes) const {
  const ScaledProjection projection(pose);
  double sum = 0;
  for (size_t i = 0; i < cells_.size(); ++i) {
    const Residual off = residual(i, projection, codes);
    const double limit = cells_[i].limit;
    sum += 0.5 * cell_weight_ * (std::isinf(off.error) ? limit : off.error / (1 + off.error / limit));
    if (std::isinf(off.error)) continue;
    const double robust = 1 / (1 + off.error / limit);
    const double factor = -weight * cell_weight_ * robust * robust * cells_[i].inverse_variance;
    const PixelJacobian jacobian = projection.jacobian(off.at);
    Vec3 turned;
    for (int axis = 0; axis < 2; ++axis) {
      const double off_px = factor * (axis == 0 ? off.x : off.y);
      for (int k = 0; k < kPoseUnknowns; ++k) by_pose[k] += off_px * jacobian.by_pose[axis][k];
      const double* by = jacobian.by_turned[axis];
      turned = turned + off_px * Vec3{by[0], by[1], by[2]};
    }
    const Vec3 by_point = transposed(pose.rotation) * turned;
    const double* linear = linear_.data() + i * 3 * codes_;
    for (size_t k = 0; k < codes_; ++k) {
      by_codes[k] += by_point.x * linear[k] + by_point.y * linear[codes_ + k] + by_point.z * linear[2 * codes_ + k];
    }
  }
  return sum;
}

AnchorTerms::Agreement AnchorTerms::agreement(const ScaledPose& pose, const double* codes) const {
  const ScaledProjection projection(pose);
  Agreement found;
  double pixels = 0, sigmas = 0;
  for (size_t i = 0; i < cells_.size(); ++i) {
    const Residual off = residual(i, projection, codes);
    if (!(off.error <= kInlierError)) continue;
    ++found.inliers;
    pixels += off.x * off.x + off.y * off.y;
    sigmas += off.error;
  }
  if (found.inliers > 0) {
    found.rms_px = std::sqrt(pixels / (2 * double(found.inliers)));
    found.rms_sigma = std::sqrt(sigmas / (2 * double(found.inliers)));
  }
  return found;
}

}  // namespace maq::head
