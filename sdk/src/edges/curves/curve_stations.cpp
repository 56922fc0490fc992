#include "edges/curves/curve_stations.h"

#include <algorithm>
#include <cmath>

#include "core/math/small_solve.h"

namespace maq {
namespace {

constexpr double kStraightSpacing_px = 6, kCurvedSpacing_px = 3, kCurvedHalfWindow_px = 4;
constexpr double kMinShift_px = 1;       // the network blurs pixels nearer to the edge
constexpr double kFallen_px = 3;         // nearer to the edge the field does not show another one
constexpr double kFarthestShift_px = 5;  // the field's value is best near the edge
constexpr double kBelief_px = 2.5;       // values that would move it farther belong to another edge
constexpr double kClearly_px = 2;        // by which the field has the edge nearer on the side that it belongs to
constexpr double kBestAcross_px = 0.08;  // lower limit of the uncertainty of a position in the image
// Unknown depth beside an edge is looked across so far, in parts of the frame's longer side: shadows and margins of
// depth cameras are no wider.
constexpr double kGap = 0.06;
constexpr double kNearer = 0.97;              // depth of what throws a shadow, as a part of that of the edge
constexpr int kSkipped_px = 3;                // next to an edge, where depth of both surfaces may be mixed
constexpr double kSamePlace_px = 1;           // edges of a near and a far surface this close in the image are one chain
constexpr double kApart_r = 2;                // edges of surfaces nearer than this are one
constexpr double kNoisy_r = 1.5, kWider = 3;  // depth that is so far from its surface needs a band so much wider
constexpr double kSameNoise = 1.5, kSameSurface = 1.2;  // worse pixels: another surface, or flying pixels
constexpr int kStray = 2;                               // stations that may have seen something else
constexpr double kFarthestPlanes_px = 0.6;  // surfaces that meet farther from the field's edge bend, or are others

Vec3 on_ray(const Intrinsics& camera, double x, double y, double inverse_depth) {
  const double z = 1 / inverse_depth;
  return {(x - camera.cx_px) / camera.fx_px * z, (y - camera.cy_px) / camera.fy_px * z, z};
}

// Calls visit(pixel index, x, y, offset across) for the pixels from `least` to `most` px beside a station.
template <class Visit>
void for_band(const EdgeField& field, const CurveStation& s, int side, double half_window, double least, double most,
              Visit&& visit) {
  const double nx = side == 0 ? s.ty : -s.ty, ny = side == 0 ? -s.tx : s.tx;
  const double reach_x = std::abs(s.tx) * half_window, reach_y = std::abs(s.ty) * half_window;
  const double x0 = s.x + std::min(nx * least, nx * most) - reach_x;
  const double x1 = s.x + std::max(nx * least, nx * most) + reach_x;
  const double y0 = s.y + std::min(ny * least, ny * most) - reach_y;
  const double y1 = s.y + std::max(ny * least, ny * most) + reach_y;
  const int top = std::max(0, int(std::ceil(y0))), bottom = std::min(field.height - 1, int(std::floor(y1)));
  const int left = std::max(0, int(std::ceil(x0))), right = std::min(field.width - 1, int(std::floor(x1)));
  for (int y = top; y <= bottom; ++y) {
    for (int x = left; x <= right; ++x) {
      const double dx = x - s.x, dy = y - s.y, across = dx * nx + dy * ny;
      if (across < least || across > most || std::abs(dx * s.tx + dy * s.ty) > half_window) continue;
      visit(size_t(y) * size_t(field.width) + size_t(x), x, y, across);
    }
  }
}

// Calls visit(px) for the pixels of a band: by how much farther away than the station the field puts the edge, where
// distances grow as they do on the surface of that side, or by 1 r a pixel where none is known.
template <class Visit>
void for_offsets(const EdgeField& field, const CurveStation& s, int side, double half_window, double least, double most,
                 Visit&& visit) {
  const SurfacePatch& patch = s.side[size_t(side)];
  const Intrinsics& camera = field.intrinsics;
  const double q = patch.terms != 0 ? patch.inverse_depth(s.x, s.y) : 0;
  const double qa = patch.terms != 0 ? patch.inverse_depth(s.x + s.tx, s.y + s.ty) : 0;
  const bool has_surface = q > 0 && qa > 0;
  const Vec3 edge = has_surface ? on_ray(camera, s.x, s.y, q) : Vec3{};
  const Vec3 along = has_surface ? normalized(on_ray(camera, s.x + s.tx, s.y + s.ty, qa) - edge) : Vec3{};
  for_band(field, s, side, half_window, least, most, [&](size_t at, int x, int y, double across) {
    if (!std::isfinite(field.distance_r[at])) return;
    const double q_here = has_surface ? patch.inverse_depth(x, y) : 0;
    double slope = 1;
    if (q_here > 0.2 * q && has_surface) {
      slope = length(cross(on_ray(camera, x, y, q_here) - edge, along)) * q_here * focal_px(camera) / across;
    }
    visit(field.distance_r[at] / std::max(slope, 0.5) - across);
  });
}

// Whether a boundary is merely where known depth ends: beyond it depth is unknown up to the image's border (a margin),
// or up to something nearer (which throws a shadow). A boundary is real if something farther follows, or nothing for
// long.
bool is_end_of_knowledge(const EdgeField& field, const CurveStation& s) {
  if (s.near_side < 0) return false;
  const SurfacePatch& patch = s.side[size_t(s.near_side)];
  const double q = patch.terms != 0 ? patch.inverse_depth(s.x, s.y) : 0;
  if (!(q > 0)) return false;
  const double out_x = s.near_side == 0 ? -s.ty : s.ty, out_y = s.near_side == 0 ? s.tx : -s.tx;
  const int farthest = int(kGap * std::max(field.width, field.height));
  for (int step = kSkipped_px; step <= farthest; ++step) {
    const auto x = int(std::lround(s.x + step * out_x)), y = int(std::lround(s.y + step * out_y));
    if (x < 0 || y < 0 || x >= field.width || y >= field.height) return step > kSkipped_px;
    const double depth = double(field.depth_m[size_t(y) * size_t(field.width) + size_t(x)]);
    if (depth > 0) return step > kSkipped_px && depth * q < kNearer;
  }
  return false;
}

}  // namespace

// Evenly along the chain; of a straight one on the line through it.
void CurveStations::place(const RidgePoint* points, const RidgeChain& chain) {
  stations.clear();
  const RidgePoint* p = points + chain.first;
  const int n = chain.count;
  double sx = 0, sy = 0;
  for (int i = 0; i < n; ++i) sx += p[i].x, sy += p[i].y;
  const double cx = sx / n, cy = sy / n;
  double xx = 0, xy = 0, yy = 0;
  for (int i = 0; i < n; ++i) {
    const double dx = p[i].x - cx, dy = p[i].y - cy;
    xx += dx * dx, xy += dx * dy, yy += dy * dy;
  }
  const double angle = 0.5 * std::atan2(2 * xy, xx - yy);
  double tx = std::cos(angle), ty = std::sin(angle);
  if ((p[n - 1].x - p[0].x) * tx + (p[n - 1].y - p[0].y) * ty < 0) tx = -tx, ty = -ty;
  // Against the parabola over the chord: noise bends neither, a curve bends one.
  double s2 = 0, s3 = 0, s4 = 0, sv2 = 0, svv = 0, sv1 = 0, from = INFINITY, to = -INFINITY;
  for (int i = 0; i < n; ++i) {
    const double dx = p[i].x - cx, dy = p[i].y - cy, u = dx * tx + dy * ty, v = dy * tx - dx * ty;
    from = std::min(from, u), to = std::max(to, u);
    s2 += u * u, s3 += u * u * u, s4 += u * u * u * u, sv1 += u * v, sv2 += u * u * v, svv += v * v;
  }
  double left = svv;
  double m[9] = {double(n), 0, 0, 0, s2, 0, s2, s3, s4}, right[3] = {0, sv1, sv2};
  if (solve_positive(m, 3, 3, right, 1)) left -= right[1] * sv1 + right[2] * sv2;
  const double straight = std::sqrt(std::max(0.0, svv) / n), bent = std::sqrt(std::max(0.0, left) / n);
  is_straight = !chain.is_closed && straight <= 0.08 + 1.4 * bent && straight < 1;
  half_window_px_ = is_straight ? kStraightSpacing_px / 2 : kCurvedHalfWindow_px;
  if (is_straight) {
    const int count = std::max(2, int(std::lround((to - from) / kStraightSpacing_px)));
    half_window_px_ = (to - from) / count / 2;
    for (int i = 0; i < count; ++i) {
      const double u = from + (to - from) * (i + 0.5) / count;
      CurveStation station{};
      station.x = cx + u * tx, station.y = cy + u * ty, station.tx = tx, station.ty = ty;
      stations.push_back(station);
    }
    return;
  }
  double since = kCurvedSpacing_px;
  const int reach = std::min(3, (n - 1) / 2);
  for (int i = 0; i < n; ++i) {
    if (i > 0) since += std::hypot(p[i].x - p[i - 1].x, p[i].y - p[i - 1].y);
    if (since < kCurvedSpacing_px && i != n - 1) continue;
    since = 0;
    CurveStation station{};
    double weight = 0, ux = 0, uy = 0;
    for (int k = -reach; k <= reach; ++k) {
      const int j = chain.is_closed ? (i + k + n) % n : std::clamp(i + k, 0, n - 1);
      ux += p[j].tx, uy += p[j].ty;
      if (std::abs(k) > std::min({reach, chain.is_closed ? n : i, chain.is_closed ? n : n - 1 - i})) continue;
      station.x += p[j].x, station.y += p[j].y, weight += 1;
    }
    const double size = std::hypot(ux, uy);
    if (!(size > 0)) continue;
    station.x /= weight, station.y /= weight, station.tx = ux / size, station.ty = uy / size;
    stations.push_back(station);
  }
}

// The pixels beside a station in rows away from it, each as far as no other edge lies in its way: there the field,
// which grows with the distance from this edge, would have fallen again.
void CurveStations::gather_band(const EdgeField& field, const CurveStation& s, const Band& band, double from_px) {
  const double nx = band.side == 0 ? s.ty : -s.ty, ny = band.side == 0 ? -s.tx : s.tx;
  const int half = int(std::max(band.half_window_px, 3.0));
  for (int u = -half; u <= half; u += band.step_px) {
    for (int across = 1; across <= band.to_px; across += band.step_px) {
      const int x = int(std::lround(s.x + u * s.tx + across * nx)), y = int(std::lround(s.y + u * s.ty + across * ny));
      if (x < 0 || y < 0 || x >= field.width || y >= field.height) break;
      const size_t at = size_t(y) * size_t(field.width) + size_t(x);
      const double off = (x - s.x) * nx + (y - s.y) * ny;
      if (across >= kFallen_px && !(field.distance_r[at] >= 0.5 * across)) break;
      const float depth = field.depth_m[at];
      if (off < from_px || !(depth > 0 && std::isfinite(depth))) continue;
      band_.push_back({double(x), double(y), 1.0 / double(depth), 1, off});
    }
  }
}

SurfacePatch CurveStations::fit_side(const EdgeField& field, const CurveStation& s, int side, double half_window_px,
                                     bool may_bend) {
  // Outside of the band of flying pixels, or nearer if the surface is too narrow.
  const Band band{side, half_window_px, double(kFlyingPixelBandPx) + double(kFitBandPx), 1};
  for (const double smear : {1.0, 0.5, 0.15}) {
    band_.clear();
    gather_band(field, s, band, smear * kFlyingPixelBandPx + 0.5);
    if (band_.size() >= 12) break;
  }
  const SurfacePatch patch = fitter_.fit(band_, s.x, s.y, focal_px(field.intrinsics), may_bend);
  if (patch.terms == 0 || !(patch.rms_footprints > kNoisy_r)) return patch;
  narrow_.swap(band_);
  const SurfacePatch wide = fit_noisy_side(field, s, side, half_window_px, may_bend);
  if (wide.terms != 0 && wide.rms_footprints <= kSameNoise * patch.rms_footprints) return wide;
  band_.swap(narrow_);
  return patch;
}

// Noisy depth needs a wide band, but a quarter of its pixels is enough: all of the band if depth at the edge is as good
// as elsewhere, or else its part away from the edge.
SurfacePatch CurveStations::fit_noisy_side(const EdgeField& field, const CurveStation& s, int side,
                                           double half_window_px, bool may_bend) {
  const double focal = focal_px(field.intrinsics), away_px = double(kFlyingPixelBandPx) + 0.5;
  band_.clear();
  gather_band(field, s, {side, half_window_px, double(kFlyingPixelBandPx) + kWider * double(kFitBandPx), 2}, 0.5);
  const SurfacePatch whole = fitter_.fit(band_, s.x, s.y, focal, may_bend);
  double squares = 0, squares_away = 0, count_away = 0;
  for (const BandPixel& pixel : band_) {
    const double off_r = focal * (whole.inverse_depth(pixel.x, pixel.y) / pixel.inverse_depth - 1);
    const bool is_away = pixel.across >= away_px;
    (is_away ? squares_away : squares) += off_r * off_r;
    count_away += is_away;
  }
  const double near_r = std::sqrt(squares / std::max(1.0, double(band_.size()) - count_away));
  if (count_away < 12 || (whole.terms != 0 && near_r <= kSameSurface * std::sqrt(squares_away / count_away))) {
    return whole;
  }
  band_.erase(std::remove_if(band_.begin(), band_.end(), [&](const BandPixel& p) { return p.across < away_px; }),
              band_.end());
  return fitter_.fit(band_, s.x, s.y, focal, may_bend);
}

void CurveStations::fit_sides(const EdgeField& field) {
  sums_.assign(2 * stations.size(), PlaneSums());
  // A short edge is one window: patches of a few pixels each would not agree on its slope along the ray.
  const bool is_one = is_straight && stations.size() <= 3;
  const double half_window = half_window_px_ * (is_one ? double(stations.size()) : 1.0);
  const size_t middle = stations.size() / 2;
  for (int side = 0; side < 2; ++side) {
    const auto at = size_t(side);
    // A surface that does not bend beside the middle of a straight edge is not asked again: that takes most of the
    // time.
    bool may_bend = true;
    if (is_straight) may_bend = fit_side(field, stations[middle], side, half_window, true).terms == 6;
    for (size_t k = is_one ? middle : 0; k < (is_one ? middle + 1 : stations.size()); ++k) {
      CurveStation& s = stations[k];
      s.side[at] = fit_side(field, s, side, half_window, may_bend);
      if (s.side[at].terms == 0 || !is_straight) continue;
      PlaneSums& sums = sums_[2 * k + at];
      sums.begin(stations[0].x, stations[0].y, s.side[at].coefficient[0]);
      for (const BandPixel& pixel : band_) sums.add(pixel);
    }
    for (size_t k = 0; is_one && k < stations.size(); ++k) {
      stations[k].side[at] = stations[middle].side[at];
      sums_[2 * k + at] = sums_[2 * middle + at];
    }
  }
}

// One plane for all of a straight chain where it is as near to the pixels as a patch at each station. Stations at its
// ends may have seen other surfaces: stations far worse than most are left out.
void CurveStations::fit_whole_sides(const EdgeField& field) {
  whole_side = {};
  for (size_t side = 0; side < 2 && is_straight; ++side) {
    residuals_.clear();
    for (const CurveStation& s : stations) {
      if (s.side[side].terms != 0) residuals_.push_back(s.side[side].rms_footprints);
    }
    if (residuals_.size() < (stations.size() + 1) / 2) continue;
    const auto middle = residuals_.begin() + std::ptrdiff_t(residuals_.size() / 2);
    std::nth_element(residuals_.begin(), middle, residuals_.end());
    const double usual = 0.05 + 1.3 * *middle;
    PlaneSums sums;
    for (size_t k = 0; k < stations.size(); ++k) {
      const SurfacePatch& patch = stations[k].side[side];
      if (patch.terms != 0 && patch.rms_footprints <= 1.5 * usual) sums.add(sums_[2 * k + side]);
    }
    const CurveStation& centre = stations[stations.size() / 2];
    const SurfacePatch whole = sums.solve(focal_px(field.intrinsics), centre.x, centre.y);
    if (whole.terms == 0 || whole.rms_footprints > usual) continue;
    whole_side[side] = whole;
    for (CurveStation& s : stations) {
      s.side[side] = whole;
      s.side[side].edge_sigma_r = sums.solve(focal_px(field.intrinsics), s.x, s.y).edge_sigma_r;
    }
  }
}

// By how many px farther away than the station the field puts an edge beside it, on side 1 more than on side 0: an edge
// that one surface ends in has small distances on its side alone.
void CurveStations::measure_field_gaps(const EdgeField& field) {
  for (CurveStation& s : stations) {
    s.field_gap_px = 0;
    for (int side = 0; side < 2; ++side) {
      double sum = 0, count = 0;
      for_offsets(field, s, side, half_window_px_, 0.5, 2, [&](double off_px) { sum += off_px, count += 1; });
      s.field_gap_px += (side == 0 ? -1 : 1) * (count > 0 ? sum / count : double(field.eps_r));
    }
  }
}

// A crease where both surfaces reach the edge at one depth and the field does not say boundary; else the boundary of
// the nearer one. An edge at which the field falls to 0 on one side belongs to that side.
void CurveStations::choose_kinds(const EdgeField& field, bool is_closed) {
  const auto n = int(stations.size());
  measure_field_gaps(field);
  for (CurveStation& s : stations) {
    for (int side = 0; side < 2; ++side) {
      s.boundary_votes[size_t(side)] = 0;
      for_band(field, s, side, half_window_px_, 0, 2.5, [&](size_t at, int, int, double) {
        s.boundary_votes[size_t(side)] += (field.kind[at] == kBoundaryEdge) - (field.kind[at] == kCreaseEdge);
      });
    }
  }
  for (int k = 0; k < n; ++k) {
    CurveStation& s = stations[size_t(k)];
    int votes[2] = {0, 0};
    double field_gap = 0, count = 0;
    for (int j = std::max(0, k - 1); j <= std::min(n - 1, k + 1); ++j) {
      for (size_t side = 0; side < 2; ++side) votes[side] += stations[size_t(j)].boundary_votes[side];
      field_gap += stations[size_t(j)].field_gap_px, count += 1;
    }
    field_gap /= count;
    s.is_boundary = votes[0] + votes[1] > 0;
    s.gap_r = 0;
    const bool has_both = s.side[0].terms != 0 && s.side[1].terms != 0;
    if (has_both) {
      const double q0 = s.side[0].inverse_depth(s.x, s.y), q1 = s.side[1].inverse_depth(s.x, s.y);
      s.gap_r = focal_px(field.intrinsics) * (q0 - q1) / std::max(q0, q1);
      // An edge that is a pixel off makes a gap as well, where surfaces are steep.
      const auto a = s.side[0].slope(s.x, s.y), b = s.side[1].slope(s.x, s.y);
      const double slack = focal_px(field.intrinsics) * std::hypot(a[0] - b[0], a[1] - b[1]) / std::max(q0, q1);
      const double sigma = std::hypot(s.side[0].edge_sigma_r, s.side[1].edge_sigma_r);
      if (std::abs(s.gap_r) > kGapR + slack + 3 * sigma) s.is_boundary = true;
    }
    const bool is_one_sided = std::abs(field_gap) > kClearly_px;
    if (is_one_sided) {
      s.near_side = field_gap > 0 ? 0 : 1;
    } else if (s.is_boundary) {
      s.near_side = has_both ? (s.gap_r > 0 ? 0 : 1) : (s.side[0].terms != 0 ? 0 : 1);
    } else {
      s.near_side = -1;
    }
  }
  find_runs(is_closed);
}

// A few stations among others of another kind are taken for theirs. A closed chain begins where a run does.
void CurveStations::find_runs(bool is_closed) {
  const int least = is_straight ? 3 : 4;
  const auto n = int(stations.size());
  const auto is_same = [](const CurveStation& a, const CurveStation& b) {
    return a.is_boundary == b.is_boundary && a.near_side == b.near_side;
  };
  if (is_closed) {
    int turn = 0;
    for (int k = 1; k < n && turn == 0; ++k) {
      bool is_new = !is_same(stations[size_t(k)], stations[size_t(k) - 1]);
      for (int j = k + 1; j < k + least; ++j) {
        is_new = is_new && is_same(stations[size_t(j % n)], stations[size_t(k)]);
      }
      if (is_new) turn = k;
    }
    std::rotate(stations.begin(), stations.begin() + turn, stations.end());
  }
  runs.clear();
  for (int k = 0; k < n; ++k) {
    const CurveStation& s = stations[size_t(k)];
    if (k == 0 || !is_same(s, stations[size_t(k) - 1])) {
      runs.push_back({k, 0, s.is_boundary ? kBoundaryEdge : kCreaseEdge, s.near_side});
    }
    ++runs.back().count;
  }
  while (runs.size() > 1) {
    const auto shortest = std::min_element(runs.begin(), runs.end(),
                                           [](const StationRun& a, const StationRun& b) { return a.count < b.count; });
    if (shortest->count >= least) break;
    const bool has_before = shortest != runs.begin(), has_after = shortest + 1 != runs.end();
    const StationRun& other =
        !has_before || (has_after && (shortest + 1)->count > (shortest - 1)->count) ? *(shortest + 1) : *(shortest - 1);
    shortest->kind = other.kind, shortest->near_side = other.near_side;
    size_t kept = 0;
    for (size_t i = 1; i < runs.size(); ++i) {
      if (runs[i].kind == runs[kept].kind && runs[i].near_side == runs[kept].near_side) {
        runs[kept].count += runs[i].count;
      } else {
        runs[++kept] = runs[i];
      }
    }
    runs.resize(kept + 1);
  }
  for (const StationRun& run : runs) {
    for (int k = run.first; k < run.first + run.count; ++k) {
      stations[size_t(k)].is_boundary = run.kind == kBoundaryEdge;
      stations[size_t(k)].near_side = run.near_side;
    }
  }
}

// One step of Gauss-Newton at each station: the edge moves sideways until the distances of the adjacent pixels, each on
// its surface, match the field.
void CurveStations::move_across(const EdgeField& field) {
  const Intrinsics& camera = field.intrinsics;
  const double max_r = 0.9 * double(field.eps_r), focal = focal_px(camera);
  shifts_.assign(stations.size(), 0);
  for (size_t k = 0; k < stations.size(); ++k) {
    CurveStation& s = stations[k];
    double weight = 0, shift = 0;
    for (int side = 0; side < 2; ++side) {
      const SurfacePatch& patch = s.side[size_t(side)];
      if (patch.terms == 0 || (s.near_side >= 0 && side != s.near_side)) continue;
      const double q = patch.inverse_depth(s.x, s.y), qa = patch.inverse_depth(s.x + s.tx, s.y + s.ty);
      if (!(q > 0 && qa > 0)) continue;
      const Vec3 edge = on_ray(camera, s.x, s.y, q);
      const Vec3 along = normalized(on_ray(camera, s.x + s.tx, s.y + s.ty, qa) - edge);
      for_band(field, s, side, half_window_px_, kMinShift_px, kFarthestShift_px,
               [&](size_t at, int x, int y, double across) {
                 const double q_here = patch.inverse_depth(x, y), value = field.distance_r[at];
                 if (!(q_here > 0.2 * q && q_here < 5 * q && value >= 0)) return;
                 const Vec3 to = on_ray(camera, x, y, q_here) - edge;
                 const double predicted = length(cross(to, along)) * q_here * focal;
                 const double slope = predicted / across, off = (predicted - value) / (kBelief_px * slope);
                 if (predicted > max_r || !(std::abs(off) < 1)) return;
                 const double spread = field.expected_error_r[at], robust = (1 - off * off) * (1 - off * off);
                 const double w = robust * slope * slope / (1 + spread * spread);
                 if (!(w > 0)) return;
                 weight += w;
                 shift += w * (side == 0 ? 1 : -1) * (predicted - value) / slope;
               });
    }
    shifts_[k] = weight > 0 ? shift / weight : 0;
    s.across_weight = weight;
  }
  for (size_t k = 0; k < stations.size(); ++k) {
    CurveStation& s = stations[k];
    const double shift = std::clamp(shifts_[k], -1.5, 1.5);
    s.x += shift * s.ty;
    s.y -= shift * s.tx;
  }
}

// Back onto one line of least squares through the moved stations.
void CurveStations::straighten() {
  double w = 0, sx = 0, sy = 0;
  for (const CurveStation& s : stations) {
    w += s.across_weight, sx += s.across_weight * s.x, sy += s.across_weight * s.y;
  }
  if (!(w > 0)) return;
  const double cx = sx / w, cy = sy / w;
  double xx = 0, xy = 0, yy = 0;
  for (const CurveStation& s : stations) {
    const double dx = s.x - cx, dy = s.y - cy;
    xx += s.across_weight * dx * dx, xy += s.across_weight * dx * dy, yy += s.across_weight * dy * dy;
  }
  const double angle = 0.5 * std::atan2(2 * xy, xx - yy);
  double tx = std::cos(angle), ty = std::sin(angle);
  if (tx * stations[0].tx + ty * stations[0].ty < 0) tx = -tx, ty = -ty;
  if (tx * stations[0].tx + ty * stations[0].ty < 0.7) return;  // fewer than two stations say where it is
  for (CurveStation& s : stations) {
    const double u = (s.x - cx) * tx + (s.y - cy) * ty;
    s.x = cx + u * tx, s.y = cy + u * ty, s.tx = tx, s.ty = ty;
  }
}

// The point that is nearest to all three: the place across from the field, and the depth of either surface, each with
// its variance. Surfaces that meet at a large angle say where the edge is better than the field does; at a small one
// they say nothing about it, and the field has it.
bool CurveStations::find_points(const EdgeField& field) {
  const Intrinsics& camera = field.intrinsics;
  const double focal = focal_px(camera);
  int known = 0;
  for (CurveStation& s : stations) {
    s.is_known = false;
    if (s.is_boundary && is_end_of_knowledge(field, s)) continue;
    const double most = 1 / (kBestAcross_px * kBestAcross_px);
    const double field_weight = s.across_weight > 0 ? std::min(s.across_weight, most) : 1;
    double a00 = field_weight, a01 = 0, a11 = 0, b0 = 0, b1 = 0;
    double unit = 0, sigma_r = 0;
    for (size_t side = 0; side < 2; ++side) {
      const SurfacePatch& patch = s.side[side];
      if (patch.terms == 0 || (s.near_side >= 0 && int(side) != s.near_side)) continue;
      const double q = patch.inverse_depth(s.x, s.y);
      if (!(q > 0)) continue;
      if (unit == 0) unit = q;
      // Unknowns: px across to the left, inverse depth / unit - 1. Depth known within sigma r is unit sigma / focal.
      const double sigma = patch.edge_sigma_r / focal, w = 1 / (sigma * sigma);
      const auto slope = patch.slope(s.x, s.y);
      const double g = (slope[0] * s.ty - slope[1] * s.tx) / unit, value = q / unit - 1;
      a00 += w * g * g, a01 -= w * g, a11 += w, b0 -= w * g * value, b1 += w * value;
      sigma_r = std::max(sigma_r, patch.edge_sigma_r);
    }
    if (unit == 0) continue;
    const double determinant = a00 * a11 - a01 * a01;
    if (!(determinant > 0)) continue;
    double shift = (a11 * b0 - a01 * b1) / determinant;
    const double ratio = shift / (kFarthestPlanes_px + 2 / std::sqrt(field_weight));
    shift /= 1 + ratio * ratio * ratio * ratio;
    const double relative = (b1 - a01 * shift) / a11;
    if (!(relative > -0.9 && relative < 10)) continue;
    const double x = s.x + shift * s.ty, y = s.y - shift * s.tx;
    s.point = on_ray(camera, x, y, unit * (1 + relative));
    s.sigma_r = std::max(sigma_r, std::sqrt(a11 / determinant));
    s.is_known = is_finite(s.point);
    known += s.is_known;
  }
  return known >= 2;
}

// Whether the surface behind an edge ends there as well: its field falls to 0 at the same place.
bool CurveStations::has_far_edge(const EdgeField& field, const CurveStation& s) const {
  if (s.near_side < 0 || s.side[0].terms == 0 || s.side[1].terms == 0) return false;
  double agree = 0, count = 0;
  for_offsets(field, s, 1 - s.near_side, half_window_px_, 0.5, 3,
              [&](double off_px) { agree += std::abs(off_px) < kSamePlace_px, count += 1; });
  return count >= 6 && agree >= 0.7 * count;
}

bool CurveStations::measure_far_side(const EdgeField& field) {
  bool has_one = false;
  for (CurveStation& s : stations) {
    s.is_known = std::abs(s.gap_r) > kApart_r && has_far_edge(field, s);
    has_one = has_one || s.is_known;
    if (s.near_side >= 0) s.near_side = 1 - s.near_side;
  }
  if (!has_one) return false;
  // Runs of stations that have one, others among them left out.
  runs.clear();
  for (size_t k = 0; k < stations.size(); ++k) {
    const CurveStation& s = stations[k];
    if (!s.is_known) continue;
    if (runs.empty() || runs.back().first + runs.back().count + 1 < int(k) || runs.back().near_side != s.near_side) {
      runs.push_back({int(k), 0, kBoundaryEdge, s.near_side});
    }
    runs.back().count = int(k) + 1 - runs.back().first;
  }
  const int least = is_straight ? 2 : 4;
  size_t kept = 0;
  for (const StationRun& run : runs) {
    if (run.count < least) continue;
    int votes = 0;
    for (int k = run.first; k < run.first + run.count; ++k) {
      CurveStation& s = stations[size_t(k)];
      s.near_side = run.near_side, s.is_known = false;
      votes += s.boundary_votes[size_t(run.near_side)];
    }
    runs[kept] = run;
    runs[kept++].kind = votes >= 0 ? kBoundaryEdge : kCreaseEdge;
  }
  runs.resize(kept);
  if (runs.empty()) return false;
  move_across(field);
  if (is_straight) straighten();
  if (!find_points(field)) return false;
  part_at_gaps(field);
  return true;
}

// Where a chain passes from one surface to another behind it, points jump along the ray: there are two edges. A station
// or two that jump by themselves saw something else.
void CurveStations::part_at_gaps(const EdgeField& field) {
  const double focal = focal_px(field.intrinsics);
  const auto is_near = [&](const CurveStation& a, const CurveStation& b) {
    const double size_px = 1 + std::hypot(a.x - b.x, a.y - b.y);
    return length(a.point - b.point) <= kLongestStep_r * size_px * std::min(a.point.z, b.point.z) / focal;
  };
  parts_.clear();
  for (const StationRun& run : runs) {
    const int end = run.first + run.count;
    int first = -1, last = -1;
    for (int k = run.first; k < end; ++k) {
      CurveStation& s = stations[size_t(k)];
      if (!s.is_known) continue;
      if (last >= 0 && !is_near(stations[size_t(last)], s)) {
        bool is_stray = false;
        for (int j = k + 1; j < std::min(end, k + 1 + kStray) && !is_stray; ++j) {
          is_stray = stations[size_t(j)].is_known && is_near(stations[size_t(last)], stations[size_t(j)]) &&
                     !is_near(s, stations[size_t(j)]);
        }
        if (is_stray) {
          s.is_known = false;
          continue;
        }
        parts_.push_back({first, last + 1 - first, run.kind, run.near_side});
        first = -1;
      }
      if (first < 0) first = k;
      last = k;
    }
    if (first >= 0) parts_.push_back({first, last + 1 - first, run.kind, run.near_side});
  }
  runs.swap(parts_);
}

bool CurveStations::measure(const EdgeField& field, const RidgePoint* points, const RidgeChain& chain) {
  place(points, chain);
  if (stations.size() < 2) return false;
  fit_sides(field);
  fit_whole_sides(field);
  choose_kinds(field, chain.is_closed);
  for (int round = 0; round < 2; ++round) {
    move_across(field);
    if (is_straight) straighten();
  }
  if (!find_points(field)) return false;
  part_at_gaps(field);
  return true;
}

}  // namespace maq
