#include "edges/measuring/plane_regions.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace maq {
namespace {

constexpr int kGridWidth = 400;  // largest width of the grid
constexpr int kSeedRadius = 2, kSeedStride = 3;
constexpr int kMinRegionPixels = 40;
constexpr double kTolerances = 3.2;        // standard deviations
constexpr double kToleranceFloorR = 0.12;  // and footprints of the grid, on top of them
constexpr int kDepthBins = 24;
constexpr double kBinsOfAnOctave = 3;
constexpr int kContactReach = 4;
constexpr double kMinJoint = 0.35, kMinJointCosine = 0.98, kMaxJointRms = 0.9, kJointSlack = 2;
constexpr int kMinOf25 = 11;  // pixels of a square of 25 at the rim of a region that is no thin strip
constexpr int kMinBinSamples = 30;
constexpr double kMinStepFraction = 0.15;
constexpr uint16_t kTooSmall = 65535;  // the stamp of a flood that is no region: none begins there again

}  // namespace

void InversePlaneSums::add(double at_x, double at_y, double inverse_depth) {
  n += 1, x += at_x, y += at_y, w += inverse_depth;
  xx += at_x * at_x, xy += at_x * at_y, yy += at_y * at_y;
  xw += at_x * inverse_depth, yw += at_y * inverse_depth, ww += inverse_depth * inverse_depth;
}

void InversePlaneSums::add(const InversePlaneSums& other) {
  n += other.n, x += other.x, y += other.y, w += other.w;
  xx += other.xx, xy += other.xy, yy += other.yy;
  xw += other.xw, yw += other.yw, ww += other.ww;
}

bool fit_inverse_plane(const InversePlaneSums& sums, InversePlane& plane, double& rms) {
  if (sums.n < 3) return false;
  const double n = sums.n, sxx = sums.xx - sums.x * sums.x / n, syy = sums.yy - sums.y * sums.y / n;
  const double sxy = sums.xy - sums.x * sums.y / n, sxw = sums.xw - sums.x * sums.w / n;
  const double syw = sums.yw - sums.y * sums.w / n, sww = sums.ww - sums.w * sums.w / n;
  const double determinant = sxx * syy - sxy * sxy;
  if (!(determinant > 1e-9 * (sxx + syy) * (sxx + syy))) return false;
  plane.a = (sxw * syy - syw * sxy) / determinant;
  plane.b = (syw * sxx - sxw * sxy) / determinant;
  plane.c = (sums.w - plane.a * sums.x - plane.b * sums.y) / n;
  rms = std::sqrt(std::max(0.0, sww - plane.a * sxw - plane.b * syw) / n);
  return true;
}

double rms_from(const InversePlaneSums& s, const InversePlane& p) {
  const double squares =
      s.ww + p.a * p.a * s.xx + p.b * p.b * s.yy + p.c * p.c * s.n +
      2 * (p.a * p.b * s.xy + p.a * p.c * s.x + p.b * p.c * s.y - p.a * s.xw - p.b * s.yw - p.c * s.w);
  return std::sqrt(std::max(0.0, squares) / s.n);
}

double PlaneRegions::tolerance(double inverse_depth) const {
  return kTolerances * (error_.constant_m * inverse_depth * inverse_depth + error_.square_per_m) +
         kToleranceFloorR * step_ * inverse_depth / focal_px_;
}

void PlaneRegions::read(const EdgeField& field) {
  step_ = std::max(1, (field.width + kGridWidth - 1) / kGridWidth);
  width_ = field.width / step_, height_ = field.height / step_;
  focal_px_ = focal_px(field.intrinsics);
  const Intrinsics& camera = field.intrinsics;
  x_.resize(size_t(width_)), y_.resize(size_t(height_));
  const int offset = step_ / 2;
  for (int i = 0; i < width_; ++i) x_[size_t(i)] = float((i * step_ + offset - camera.cx_px) / camera.fx_px);
  for (int j = 0; j < height_; ++j) y_[size_t(j)] = float((j * step_ + offset - camera.cy_px) / camera.fy_px);
  inverse_.resize(size_t(width_) * size_t(height_));
  for (int j = 0; j < height_; ++j) {
    const float* row = &field.depth_m[size_t(j * step_ + offset) * size_t(field.width) + size_t(offset)];
    float* to = &inverse_[size_t(j) * size_t(width_)];
    for (int i = 0; i < width_; ++i) {
      const float depth = row[i * step_];
      to[i] = depth > 1e-3f && depth < 1e3f ? 1 / depth : 0;
    }
  }
}

// Returns false if a pixel of the window is unknown or taken.
bool PlaneRegions::window_sums(int column, int row, InversePlaneSums& sums) const {
  for (int j = row - kSeedRadius; j <= row + kSeedRadius; ++j) {
    const size_t at = size_t(j) * size_t(width_);
    for (int i = column - kSeedRadius; i <= column + kSeedRadius; ++i) {
      const double w = double(inverse_[at + size_t(i)]);
      if (w == 0 || labels_[at + size_t(i)] != 0) return false;
      sums.add(double(x_[size_t(i)]), double(y_[size_t(j)]), w);
    }
  }
  return true;
}

void PlaneRegions::find_seeds() {
  seeds_.clear();
  for (int j = kSeedRadius; j + kSeedRadius < height_; j += kSeedStride) {
    for (int i = kSeedRadius; i + kSeedRadius < width_; i += kSeedStride) {
      InversePlaneSums sums;
      InversePlane plane;
      double rms = 0;
      if (!window_sums(i, j, sums) || !fit_inverse_plane(sums, plane, rms)) continue;
      const double octaves = std::log2(double(inverse_[size_t(j * width_ + i)]));
      const int bin = std::clamp(int(kDepthBins / 2.0 - kBinsOfAnOctave * octaves), 0, kDepthBins - 1);
      seeds_.push_back({j * width_ + i, float(rms), bin});
    }
  }
}

// The lower quartile of the seeds' residuals at each depth, and the steps in which depth comes.
void PlaneRegions::estimate_error() {
  double sums[2][2] = {}, right[2] = {};
  const auto quantile = [&](double fraction) {
    const auto at = samples_.begin() + ptrdiff_t(fraction * double(samples_.size() - 1));
    std::nth_element(samples_.begin(), at, samples_.end());
    return double(*at);
  };
  std::array<double, kDepthBins> rough{}, steps{};
  std::array<size_t, kDepthBins> counts{};
  for (int bin = 0; bin < kDepthBins; ++bin) {
    samples_.clear();
    for (const Seed& seed : seeds_) {
      const float w = inverse_[size_t(seed.cell)];
      if (seed.bin == bin) samples_.push_back(seed.roughness / (w * w));
    }
    counts[size_t(bin)] = samples_.size();
    if (samples_.size() >= kMinBinSamples) rough[size_t(bin)] = quantile(0.25);
    samples_.clear();
    for (const Seed& seed : seeds_) {
      const size_t at = size_t(seed.cell);
      const float w = inverse_[at], bend = std::abs(inverse_[at - 1] - 2 * w + inverse_[at + 1]);
      if (seed.bin == bin && bend > 0) samples_.push_back(bend / (w * w));
    }
    // Fewer are the edges of things, not steps of depth.
    if (double(samples_.size()) >= std::max(double(kMinBinSamples), kMinStepFraction * double(counts[size_t(bin)]))) {
      steps[size_t(bin)] = quantile(0.2);
    }
  }
  for (int bin = 0; bin < kDepthBins; ++bin) {
    if (counts[size_t(bin)] < kMinBinSamples) continue;
    const double depth = std::exp2((bin + 0.5 - kDepthBins / 2.0) / kBinsOfAnOctave), square = depth * depth;
    const double error = std::hypot(rough[size_t(bin)], 0.35 * steps[size_t(bin)]);
    // Relative errors count: far depth has the larger ones.
    const double weight = double(counts[size_t(bin)]) / (square * square);
    sums[0][0] += weight, sums[0][1] += weight * square, sums[1][1] += weight * square * square;
    right[0] += weight * error, right[1] += weight * square * error;
  }
  error_ = {};
  if (!(sums[0][0] > 0)) return;
  const double determinant = sums[0][0] * sums[1][1] - sums[0][1] * sums[0][1];
  double constant = -1, square = -1;
  if (determinant > 1e-9 * sums[0][0] * sums[1][1]) {
    constant = (right[0] * sums[1][1] - right[1] * sums[0][1]) / determinant;
    square = (right[1] * sums[0][0] - right[0] * sums[0][1]) / determinant;
  }
  if (constant < 0 || square < 0) {
    // One part alone: that which fits better at a weight of 1 is not worth a choice. Disparity is the common case.
    constant = square < 0 && constant > 0 ? right[0] / sums[0][0] : 0;
    square = constant > 0 ? 0 : right[1] / sums[1][1];
  }
  error_ = {std::max(0.0, constant), std::max(0.0, square)};
}

// Floods from a cell. Returns the number of pixels.
double PlaneRegions::grow(int cell, uint16_t stamp, InversePlane& plane, int& count) {
  InversePlaneSums sums;
  double rms = 0;
  if (count == 0) {  // the first flood begins with the window around the cell
    window_sums(cell % width_, cell / width_, sums);
    if (!fit_inverse_plane(sums, plane, rms)) return 0;
  }
  const bool refits = count == 0;
  sums = {};
  queue_.clear();
  queue_.push_back(cell);
  stamps_[size_t(cell)] = stamp;
  size_t next_fit = 30;
  for (size_t head = 0; head < queue_.size(); ++head) {
    const int at = queue_[head], column = at % width_, row = at / width_;
    sums.add(double(x_[size_t(column)]), double(y_[size_t(row)]), double(inverse_[size_t(at)]));
    if (refits && head >= next_fit) {
      fit_inverse_plane(sums, plane, rms);
      next_fit = head + head / 2;
    }
    const auto visit = [&](bool is_inside, int to, int to_column, int to_row) {
      if (!is_inside || stamps_[size_t(to)] == stamp || labels_[size_t(to)] != 0) return;
      const double w = double(inverse_[size_t(to)]);
      if (w == 0) return;
      const double off = w - plane.at(double(x_[size_t(to_column)]), double(y_[size_t(to_row)]));
      if (std::abs(off) > tolerance(w)) return;
      stamps_[size_t(to)] = stamp;
      queue_.push_back(to);
    };
    visit(column > 0, at - 1, column - 1, row);
    visit(column + 1 < width_, at + 1, column + 1, row);
    visit(row > 0, at - width_, column, row - 1);
    visit(row + 1 < height_, at + width_, column, row + 1);
  }
  count = int(queue_.size());
  fit_inverse_plane(sums, plane, rms);
  return rms;
}

bool PlaneRegions::set_plane(PlaneRegion& region, double& rms) const {
  if (!fit_inverse_plane(region.sums, region.inverse, rms)) return false;
  const InversePlane& fit = region.inverse;
  const double scale = std::sqrt(fit.a * fit.a + fit.b * fit.b + fit.c * fit.c);
  const double x = region.sums.x / region.sums.n, y = region.sums.y / region.sums.n;
  if (!(scale > 1e-6) || !(fit.at(x, y) > 0)) return false;
  region.plane = {(-1 / scale) * Vec3{fit.a, fit.b, fit.c}, -1 / scale};
  const double depth = 1 / fit.at(x, y);
  region.centre = {depth * x, depth * y, depth};
  region.rms_m = rms * depth * depth;
  return true;
}

// Where a plane cuts another surface, a flood follows the cut in a strip of a pixel or two.
bool PlaneRegions::is_thin(int cell, uint16_t stamp) const {
  const int column = cell % width_, row = cell / width_;
  if (column < 2 || row < 2 || column + 2 >= width_ || row + 2 >= height_) return false;
  const auto is_member = [&](int to) { return stamps_[size_t(to)] == stamp; };
  if (is_member(cell - 1) && is_member(cell + 1) && is_member(cell - width_) && is_member(cell + width_)) return false;
  int members = 0;
  for (int j = -2; j <= 2; ++j) {
    for (int i = -2; i <= 2; ++i) members += is_member(cell + j * width_ + i);
  }
  return members < kMinOf25;
}

void PlaneRegions::find(const EdgeField& field) {
  regions_.clear();
  if (field.width < 1 || field.height < 1) {
    width_ = height_ = 0;
    return;
  }
  read(field);
  labels_.assign(inverse_.size(), 0);
  stamps_.assign(inverse_.size(), 0);
  find_seeds();
  estimate_error();
  // The flattest first, by the error that is expected there.
  for (Seed& seed : seeds_) {
    const double w = double(inverse_[size_t(seed.cell)]);
    seed.roughness = float(double(seed.roughness) / tolerance(w));
  }
  std::sort(seeds_.begin(), seeds_.end(), [](const Seed& a, const Seed& b) {
    return a.roughness != b.roughness ? a.roughness < b.roughness : a.cell < b.cell;
  });
  uint16_t stamp = 0;
  for (const Seed& seed : seeds_) {
    if (seed.roughness > 1 || int(regions_.size()) >= kMaxRegions || stamp > kTooSmall - 3) break;
    if (labels_[size_t(seed.cell)] != 0 || stamps_[size_t(seed.cell)] == kTooSmall) continue;
    InversePlaneSums sums;
    if (!window_sums(seed.cell % width_, seed.cell / width_, sums)) continue;
    InversePlane plane;
    int count = 0;
    grow(seed.cell, ++stamp, plane, count);
    if (count >= kMinRegionPixels) grow(seed.cell, ++stamp, plane, count);
    if (count < kMinRegionPixels) {
      for (const int at : queue_) stamps_[size_t(at)] = kTooSmall;
      continue;
    }
    PlaneRegion region;
    region.left = region.top = 1 << 30;
    for (const int at : queue_) {
      if (is_thin(at, stamp)) continue;
      labels_[size_t(at)] = uint8_t(regions_.size() + 1);
      const int column = at % width_, row = at / width_;
      region.sums.add(double(x_[size_t(column)]), double(y_[size_t(row)]), double(inverse_[size_t(at)]));
      region.left = std::min(region.left, column), region.right = std::max(region.right, column);
      region.top = std::min(region.top, row), region.bottom = std::max(region.bottom, row);
    }
    double rms = 0;
    if (region.sums.n == 0) continue;
    if (!set_plane(region, rms)) {
      for (const int at : queue_)
        labels_[size_t(at)] = labels_[size_t(at)] == regions_.size() + 1 ? 0 : labels_[size_t(at)];
      continue;
    }
    regions_.push_back(region);
  }
  join_regions();
}

void PlaneRegions::count_contacts() {
  const size_t count = regions_.size();
  contacts_.assign(count * count, 0);
  const auto look = [&](int column, int row, int dx, int dy) {
    const int a = label(column, row);
    for (int t = 1; t <= kContactReach; ++t) {
      const int to_column = column + t * dx, to_row = row + t * dy;
      if (to_column >= width_ || to_row >= height_) return;
      const int b = label(to_column, to_row);
      if (b == 0) continue;
      if (b != a) ++contacts_[size_t(std::min(a, b) - 1) * count + size_t(std::max(a, b) - 1)];
      return;
    }
  };
  for (int row = 0; row < height_; ++row) {
    for (int column = 0; column < width_; ++column) {
      if (label(column, row) == 0) continue;
      look(column, row, 1, 0);
      look(column, row, 0, 1);
    }
  }
}

// A face that bulges, or whose depth is bent by the sensor, is one region all the same.
void PlaneRegions::join_regions() {
  count_contacts();
  const size_t count = regions_.size();
  std::array<uint8_t, kMaxRegions + 1> joined{};  // by label
  for (size_t k = 0; k <= count; ++k) joined[k] = uint8_t(k);
  for (bool changes = true; changes;) {
    changes = false;
    for (size_t a = 0; a < count; ++a) {
      for (size_t b = a + 1; b < count; ++b) {
        PlaneRegion &one = regions_[a], &other = regions_[b];
        if (one.sums.n == 0 || other.sums.n == 0) continue;
        int& contacts = contacts_[a * count + b];
        if (contacts < kMinJoint * std::sqrt(std::min(one.sums.n, other.sums.n))) continue;
        if (dot(one.plane.normal, other.plane.normal) < kMinJointCosine) continue;
        PlaneRegion both = one;
        both.sums.add(other.sums);
        double rms = 0;
        if (!set_plane(both, rms)) continue;
        const double one_rms = rms_from(one.sums, both.inverse), other_rms = rms_from(other.sums, both.inverse);
        if (one_rms > kMaxJointRms * tolerance(1 / one.centre.z) ||
            other_rms > kMaxJointRms * tolerance(1 / other.centre.z))
          continue;
        both.slack = kJointSlack;
        both.left = std::min(one.left, other.left), both.right = std::max(one.right, other.right);
        both.top = std::min(one.top, other.top), both.bottom = std::max(one.bottom, other.bottom);
        one = both;
        other.sums = {};
        contacts = 0;
        for (size_t c = 0; c < count; ++c) {
          if (c == a || c == b) continue;
          int& moved = contacts_[std::min(b, c) * count + std::max(b, c)];
          contacts_[std::min(a, c) * count + std::max(a, c)] += moved;
          moved = 0;
        }
        for (size_t k = 1; k <= count; ++k) joined[k] = joined[k] == b + 1 ? uint8_t(a + 1) : joined[k];
        changes = true;
      }
    }
  }
  // Regions that remain move up.
  std::array<uint8_t, kMaxRegions + 1> final_label{};
  size_t kept = 0;
  for (size_t k = 0; k < count; ++k) {
    if (regions_[k].sums.n == 0) continue;
    regions_[kept] = regions_[k];
    final_label[k + 1] = uint8_t(++kept);
  }
  if (kept == count) return;
  regions_.resize(kept);
  for (uint8_t& label : labels_) label = final_label[joined[label]];
  count_contacts();
}

// Fits a paraboloid to the distances of its points from its plane.
double PlaneRegions::roundness(int region) const {
  const PlaneRegion& face = regions_[size_t(region)];
  const Vec3 along = any_orthogonal(face.plane.normal), across = cross(face.plane.normal, along);
  constexpr size_t kTerms = 6;
  std::array<std::array<double, kTerms + 1>, kTerms> rows{};
  const double scale = 1 / std::sqrt(double(face.pixels())) / (face.centre.z / focal_px_ * step_);  // to about 1
  for (int row = face.top; row <= face.bottom; ++row) {
    for (int column = face.left; column <= face.right; ++column) {
      if (label(column, row) != region + 1) continue;
      const double depth = 1 / double(inverse_[size_t(row) * size_t(width_) + size_t(column)]);
      const Vec3 from = Vec3{depth * double(x_[size_t(column)]), depth * double(y_[size_t(row)]), depth} - face.centre;
      const double s = scale * dot(from, along), t = scale * dot(from, across),
                   h = scale * dot(from, face.plane.normal);
      const std::array<double, kTerms + 1> terms{1, s, t, s * s, s * t, t * t, h};
      for (size_t i = 0; i < kTerms; ++i) {
        for (size_t j = i; j <= kTerms; ++j) rows[i][j] += terms[i] * terms[j];
      }
    }
  }
  const double n = rows[0][0], spread_s = rows[0][3] / n, spread_t = rows[0][5] / n, spread_st = rows[0][4] / n;
  for (size_t i = 0; i < kTerms; ++i) {
    for (size_t j = 0; j < i; ++j) rows[i][j] = rows[j][i];
  }
  for (size_t i = 0; i < kTerms; ++i) {
    if (!(rows[i][i] > 1e-9 * n)) return 0;
    for (size_t k = i + 1; k < kTerms; ++k) {
      const double factor = rows[k][i] / rows[i][i];
      for (size_t j = i; j <= kTerms; ++j) rows[k][j] -= factor * rows[i][j];
    }
  }
  std::array<double, kTerms> solution{};
  for (size_t i = kTerms; i-- > 0;) {
    double sum = rows[i][kTerms];
    for (size_t j = i + 1; j < kTerms; ++j) sum -= rows[i][j] * solution[j];
    solution[i] = sum / rows[i][i];
  }
  const double a = solution[3], b = 0.5 * solution[4], c = solution[5];
  const double root = std::hypot(0.5 * (a - c), b);
  const double angle = 0.5 * std::atan2(2 * b, a - c) + (a + c < 0 ? M_PI / 2 : 0);
  const double bend = 0.5 * (a + c) + (a + c < 0 ? -root : root);  // h = bend * s^2 along that direction
  const double cosine = std::cos(angle), sine = std::sin(angle);
  const double spread = cosine * cosine * spread_s + 2 * cosine * sine * spread_st + sine * sine * spread_t;
  const double chord = std::sqrt(12 * std::max(0.0, spread));  // of a uniform distribution
  return std::abs(bend) * chord / 4;
}

}  // namespace maq
