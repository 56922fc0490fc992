#include "edges/curves/curve_extractor.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "edges/curves/curve_drawing.h"

namespace maq {
namespace {

constexpr double kWorst_r = 3;        // a curve farther from its points is rejected
constexpr double kBestSigma_r = 0.1;  // upper limit of the weight of a station
constexpr double kMisplaced_px = 2;   // distance of a line's ends from their place in the image
constexpr double kMaxBeyond_px = 6;   // distance of a curve's ends beyond its first and last station
constexpr int kMaxOffEnds = 3;
constexpr int kLengthen_px = 6;  // distance over which votes are followed beyond a free end

void require(bool is_right, const char* name, double value, const char* range) {
  if (!is_right) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "The curve option ", name, " is ", value, "; it must be ", range, ".");
  }
}

void check_field(const EdgeField& field) {
  const bool has_size = field.width >= 0 && field.height >= 0;
  const size_t pixels = has_size ? size_t(field.width) * size_t(field.height) : 0;
  if (!has_size || field.distance_r.size() != pixels || field.expected_error_r.size() != pixels ||
      field.kind.size() != pixels || field.depth_m.size() != pixels) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "The distance field's planes have ", field.distance_r.size(), ", ",
                field.expected_error_r.size(), ", ", field.kind.size(), " and ", field.depth_m.size(),
                " values, not those of ", field.width, "x", field.height, " pixels.");
  }
  const Intrinsics& camera = field.intrinsics;
  if (!(camera.fx_px > 0 && camera.fy_px > 0 && std::isfinite(camera.fx_px + camera.fy_px) &&
        std::isfinite(camera.cx_px + camera.cy_px))) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "The camera's focal lengths are ", camera.fx_px, " and ", camera.fy_px,
                " px. Give the depth camera's calibration.");
  }
}

// Returns the point of the line through `a` along `direction` that is nearest to the pixel's ray.
Vec3 seen_on_line(const Intrinsics& camera, double x, double y, Vec3 a, Vec3 direction) {
  const Vec3 ray = normalized({(x - camera.cx_px) / camera.fx_px, (y - camera.cy_px) / camera.fy_px, 1});
  const double cosine = dot(ray, direction), sine_squared = 1 - cosine * cosine;
  if (!(sine_squared > 1e-6)) return a;
  return a + ((dot(a, ray) * cosine - dot(a, direction)) / sine_squared) * direction;
}

struct Pixel {
  double x, y;
};

Pixel project(const Intrinsics& camera, Vec3 p) {
  return {camera.fx_px * p.x / p.z + camera.cx_px, camera.fy_px * p.y / p.z + camera.cy_px};
}

// Takes the part of an arc that begins at an angle.
void take_arc(const ArcFit& arc, double from_rad, double sweep_rad, EdgeCurve& curve, std::array<Vec3, 2>& end,
              std::array<Vec3, 2>& outward) {
  const double c = std::cos(from_rad), s = std::sin(from_rad);
  curve.type = CurveType::kArc;
  curve.rms_footprints = arc.rms;
  curve.centre = arc.centre;
  curve.x_axis = c * arc.x_axis + s * arc.y_axis;
  curve.y_axis = c * arc.y_axis - s * arc.x_axis;
  curve.sweep_rad = sweep_rad;
  const double ce = std::cos(sweep_rad), se = std::sin(sweep_rad);
  end = {arc.centre + curve.x_axis, arc.centre + ce * curve.x_axis + se * curve.y_axis};
  outward = {-normalized(curve.y_axis), normalized(ce * curve.y_axis - se * curve.x_axis)};
}

}  // namespace

void CurveExtractor::set_options(const CurveOptions& options) {
  const float length_px = options.min_length_px;
  require(length_px >= 4 && length_px <= 1e6f, "min_length_px", length_px, "4 to 1e6");
  options_ = options;
}

const EdgeCurves& CurveExtractor::extract(const EdgeField& field) {
  check_field(field);
  found_.curves.clear();
  found_.corners.clear();
  found_.points.clear();
  found_.controls.clear();
  found_.counts = CurveCounts();
  drafts_.clear();
  votes_.gather(field, found_.counts);
  chains_.trace(votes_, options_, found_.counts);
  for (const RidgeChain& chain : chains_.chains) draft_curves(field, chain);
  join_corners(field);
  for (Draft& draft : drafts_) append_curve(draft.curve, draft.end, found_);
  return found_;
}

void CurveExtractor::draft_curves(const EdgeField& field, const RidgeChain& chain) {
  if (!stations_.measure(field, chains_.points.data(), chain)) {
    ++found_.counts.without_depth;
    return;
  }
  draft_runs(field, chain);
  if (stations_.measure_far_side(field)) draft_runs(field, chain);
}

void CurveExtractor::draft_runs(const EdgeField& field, const RidgeChain& chain) {
  // An arc continues where its kind changes: the rim of a cup is one circle, and its far half is a boundary.
  if (!stations_.is_straight && stations_.runs.size() > 1 && draft_arcs(field, chain)) return;
  for (const StationRun& run : stations_.runs) {
    Draft draft;
    if (fit_run(field, chain, run, draft)) {
      keep(field, run, draft);
    } else {
      ++found_.counts.not_fitted;
    }
  }
}

// Gathers the stations that have a point. Stations at the ends are near a corner and may have measured another surface.
// They are left out if they are far from the next station.
void CurveExtractor::gather_points(const EdgeField& field, const StationRun& run) {
  fit_points_.clear();
  int from = run.first, to = run.first + run.count - 1;
  const auto is_off = [&](int at, int next) {
    const CurveStation &a = stations_.stations[size_t(at)], &b = stations_.stations[size_t(next)];
    if (!a.is_known || !b.is_known) return !a.is_known;
    const double size_px = 1 + std::hypot(a.x - b.x, a.y - b.y);
    return length(a.point - b.point) >
           kLongestStep_r * size_px * std::min(a.point.z, b.point.z) / focal_px(field.intrinsics);
  };
  for (int i = 0; i < kMaxOffEnds && to - from >= 4 && is_off(from, from + 1); ++i) ++from;
  for (int i = 0; i < kMaxOffEnds && to - from >= 4 && is_off(to, to - 1); ++i) --to;
  for (int k = from; k <= to; ++k) {
    const CurveStation& s = stations_.stations[size_t(k)];
    if (!s.is_known) continue;
    const double sigma = std::max(s.sigma_r, kBestSigma_r);
    fit_points_.push_back({s.point, s.point.z / focal_px(field.intrinsics), 1 / (sigma * sigma)});
  }
}

// Fits one circle to all runs. Each run becomes a part of it.
bool CurveExtractor::draft_arcs(const EdgeField& field, const RidgeChain& chain) {
  const auto n = int(stations_.stations.size());
  gather_points(field, {0, n, kCreaseEdge, -1});
  const auto arc = arc_fitter_.fit(fit_points_.data(), fit_points_.size());
  if (!arc || !(arc->rms <= kToleranceR)) return false;
  const auto angle_of = [&](int k) {
    const CurveStation& s = stations_.stations[size_t((k % n + n) % n)];
    const Vec3 d = s.point - arc->centre;
    return std::atan2(dot(d, arc->y_axis), dot(d, arc->x_axis));
  };
  for (const StationRun& run : stations_.runs) {
    // The part begins halfway to the previous station and ends halfway to the next one.
    const bool has_before = run.first > 0 || chain.is_closed, has_after = run.first + run.count < n || chain.is_closed;
    double before = angle_of(run.first), angle = before, sweep = 0, lead = 0;
    for (int k = run.first + 1; k < run.first + run.count; ++k) {
      sweep += std::remainder(angle_of(k) - angle, 2 * M_PI);
      angle = angle_of(k);
    }
    if (has_before) lead = std::remainder(before - angle_of(run.first - 1), 2 * M_PI) / 2;
    if (has_after) sweep += std::remainder(angle_of(run.first + run.count) - angle, 2 * M_PI) / 2;
    double from = before - lead;
    sweep += lead;
    if (sweep < 0) from += sweep, sweep = -sweep;
    Draft draft;
    draft.curve.kind = run.kind;
    take_arc(*arc, from, std::min(sweep, 2 * M_PI), draft.curve, draft.end, draft.outward);
    keep(field, run, draft);
  }
  return true;
}

// Takes the simplest type that is near enough to the points of the stations: line, arc, spline.
bool CurveExtractor::fit_run(const EdgeField& field, const RidgeChain& chain, const StationRun& run, Draft& draft) {
  EdgeCurve& curve = draft.curve;
  curve.kind = run.kind;
  gather_points(field, run);
  const FitPoint* points = fit_points_.data();
  const size_t count = fit_points_.size();
  const bool is_closed = chain.is_closed && stations_.runs.size() == 1;
  const auto line = fit_line(points, count);
  if (!line) return false;
  if (!is_closed && (line->rms <= kToleranceR || stations_.is_straight)) {
    if (!(line->rms <= kWorst_r)) return false;
    curve.type = CurveType::kLine;
    curve.rms_footprints = line->rms;
    draft.end = {line->from, line->to};
    if (stations_.is_straight && !place_line(field, chain, run, draft)) return false;
    const Vec3 along = normalized(draft.end[1] - draft.end[0]);
    draft.outward = {-along, along};
    return true;
  }
  if (const auto arc = arc_fitter_.fit(points, count); arc && arc->rms <= kToleranceR) {
    curve.is_closed = arc->is_closed;
    take_arc(*arc, 0, arc->sweep_rad, curve, draft.end, draft.outward);
    return true;
  }
  const auto rms = spline_fitter_.fit(points, count, is_closed, kToleranceR);
  if (!rms || !(*rms <= kWorst_r)) return false;
  curve.type = CurveType::kSpline;
  curve.rms_footprints = *rms;
  curve.is_closed = is_closed;
  curve.first_control = int(found_.controls.size());
  const auto& controls = spline_fitter_.controls();
  curve.control_count = int(controls.size());
  found_.controls.insert(found_.controls.end(), controls.begin(), controls.end());
  const size_t n = controls.size();
  draft.end = {controls[0], controls[n - 1]};
  draft.outward = {normalized(controls[0] - controls[1]), normalized(controls[n - 1] - controls[n - 2])};
  return true;
}

// A station is the middle of the piece it measured: the edge is as long as its chain, or its run of stations. Returns
// false if the line does not cover this length in the image: then it runs along the rays, between surfaces.
bool CurveExtractor::place_line(const EdgeField& field, const RidgeChain& chain, const StationRun& run,
                                Draft& draft) const {
  const Vec3 a = draft.end[0], along = normalized(draft.end[1] - a);
  const auto n = int(stations_.stations.size());
  const auto end_of = [&](int before, int after) -> Pixel {
    const CurveStation& s = stations_.stations[size_t(std::max(before, 0))];
    double u = 0;
    if (before < 0 || after == n) {
      const RidgePoint& p = chains_.points[size_t(before < 0 ? chain.first : chain.first + chain.count - 1)];
      u = (p.x - s.x) * s.tx + (p.y - s.y) * s.ty;
    } else {
      const CurveStation& next = stations_.stations[size_t(after)];
      u = ((next.x - s.x) * s.tx + (next.y - s.y) * s.ty) / 2;
    }
    return {s.x + u * s.tx, s.y + u * s.ty};
  };
  const Pixel ends[2] = {end_of(run.first - 1, run.first), end_of(run.first + run.count - 1, run.first + run.count)};
  for (size_t k = 0; k < 2; ++k) {
    draft.end[k] = seen_on_line(field.intrinsics, ends[k].x, ends[k].y, a, along);
    const Pixel seen = project(field.intrinsics, draft.end[k]);
    if (!(draft.end[k].z > 0) || !(std::hypot(seen.x - ends[k].x, seen.y - ends[k].y) < kMisplaced_px)) return false;
  }
  return true;
}

// Returns whether a curve runs along the rays between two surfaces rather than along one: its ends do not appear where
// its stations end, or a line is within 10 degrees of a ray.
bool CurveExtractor::is_along_rays(const EdgeField& field, const StationRun& run, const Draft& draft) const {
  const CurveStation &first = stations_.stations[size_t(run.first)],
                     &last = stations_.stations[size_t(run.first + run.count) - 1];
  for (const Vec3& end : draft.end) {
    if (!(end.z > 0)) return true;
    const Pixel seen = project(field.intrinsics, end);
    const double off =
        std::min(std::hypot(seen.x - first.x, seen.y - first.y), std::hypot(seen.x - last.x, seen.y - last.y));
    if (!(off <= kMaxBeyond_px)) return true;
  }
  // The angle is measured at the near end, where a real receding line is seen most from the side.
  const Vec3 near = draft.end[0].z < draft.end[1].z ? draft.end[0] : draft.end[1];
  const double sine = length(cross(normalized(near), normalized(draft.end[1] - draft.end[0])));
  return draft.curve.type == CurveType::kLine && sine < 1 / kLongestStep_r;
}

void CurveExtractor::keep(const EdgeField& field, const StationRun& run, Draft& draft) {
  if (is_along_rays(field, run, draft)) {
    ++found_.counts.not_fitted;
    return;
  }
  describe_sides(field, run, draft.curve);
  for (size_t k = 0; k < 2; ++k) {
    const double r = std::max(draft.end[k].z, 1e-12) / focal_px(field.intrinsics);
    const Pixel a = project(field.intrinsics, draft.end[k]),
                b = project(field.intrinsics, draft.end[k] + r * draft.outward[k]);
    draft.r_m[k] = r;
    draft.step_m[k] = r * std::clamp(1 / std::hypot(b.x - a.x, b.y - a.y), 1.0, kLongestStep_r);
    if (!std::isfinite(draft.step_m[k])) draft.step_m[k] = r;
  }
  drafts_.push_back(draft);
}

// Finds the adjacent planes of a straight edge and the convexity of a crease: at a point beside the edge, is the other
// surface, extended, in front of it or behind it?
void CurveExtractor::describe_sides(const EdgeField& field, const StationRun& run, EdgeCurve& curve) const {
  const double focal = focal_px(field.intrinsics);
  int convex = 0;
  for (int k = run.first; k < run.first + run.count; ++k) {
    const CurveStation& s = stations_.stations[size_t(k)];
    if (s.side[0].terms == 0 || s.side[1].terms == 0 || s.near_side >= 0) continue;
    const double x = s.x + kPatchScale_px * s.ty, y = s.y - kPatchScale_px * s.tx;
    const auto a = s.side[0].slope(s.x, s.y), b = s.side[1].slope(s.x, s.y);
    const double own = a[0] * (x - s.x) + a[1] * (y - s.y), other = b[0] * (x - s.x) + b[1] * (y - s.y);
    const double behind_r = focal * (other - own) / s.side[0].inverse_depth(s.x, s.y);
    const double sigma = std::hypot(s.side[0].edge_sigma_r, s.side[1].edge_sigma_r);
    if (std::abs(behind_r) > 3 * sigma) convex += behind_r > 0 ? 1 : -1;
  }
  if (curve.kind == kCreaseEdge && convex != 0) curve.convexity = convex > 0 ? Convexity::kConvex : Convexity::kConcave;
  const CurveStation& middle = stations_.stations[size_t(run.first + run.count / 2)];
  for (size_t side = 0; side < 2; ++side) {
    const SurfacePatch& patch = stations_.whole_side[side];
    if (patch.terms != 3 || (middle.near_side >= 0 && int(side) != middle.near_side)) continue;
    curve.has_plane[side] = true;
    curve.plane[side] = plane_of(patch, field.intrinsics);
  }
}

// The votes of a corner have many directions, so that chains end before it. A line is extended as far as there are
// votes for it.
void CurveExtractor::lengthen_end(const EdgeField& field, Draft& draft, int which) const {
  if (draft.curve.type != CurveType::kLine) return;
  const Vec3 end = draft.end[size_t(which)], outward = draft.outward[size_t(which)];
  const Pixel from = project(field.intrinsics, end),
              to = project(field.intrinsics, end + draft.step_m[size_t(which)] * outward);
  const double size = std::hypot(to.x - from.x, to.y - from.y);
  if (!(size > 0)) return;
  const double dx = (to.x - from.x) / size, dy = (to.y - from.y) / size;
  for (int step = 1; step <= kLengthen_px; ++step) {
    const double u = step, px = from.x + u * dx, py = from.y + u * dy;
    if (!(px > -0.5 && py > -0.5 && px < field.width - 0.5 && py < field.height - 0.5)) break;
    const size_t at = size_t(std::lround(py)) * size_t(field.width) + size_t(std::lround(px));
    const double along = (dy * dy - dx * dx) * votes_.cos2[at] - 2 * dx * dy * votes_.sin2[at];
    if (!(along > 0.3 * kMinVotes)) break;
    const Vec3 reached = seen_on_line(field.intrinsics, px, py, end, outward);
    if (reached.z > 0) draft.end[size_t(which)] = reached;
  }
}

void CurveExtractor::join_corners(const EdgeField& field) {
  ends_.clear();
  for (size_t i = 0; i < drafts_.size(); ++i) {
    const Draft& draft = drafts_[i];
    if (draft.curve.is_closed) continue;
    for (int k = 0; k < 2; ++k) {
      lengthen_end(field, drafts_[i], k);
      ends_.push_back({int(i), k, draft.end[size_t(k)], draft.outward[size_t(k)], draft.r_m[size_t(k)],
                       draft.step_m[size_t(k)], -1});
    }
  }
  corner_finder_.find(ends_, kMergeRadiusPx, found_.corners);
  for (Draft& draft : drafts_) draft.curve.corner = {-1, -1};
  for (const CurveEnd& end : ends_) {
    Draft& draft = drafts_[size_t(end.curve)];
    draft.curve.corner[size_t(end.which)] = end.corner;
    if (end.corner >= 0) move_end(draft, end.which, found_.corners[size_t(end.corner)].point);
  }
}

void CurveExtractor::move_end(Draft& draft, int which, Vec3 to) {
  EdgeCurve& curve = draft.curve;
  if (curve.type == CurveType::kArc) {
    const Vec3 d = to - curve.centre;
    const double angle = std::atan2(dot(d, curve.y_axis), dot(d, curve.x_axis));
    const double reach = draft.step_m[size_t(which)] * 1.5 * kMergeRadiusPx / length(curve.x_axis);
    if (which == 1) {
      const double change = std::remainder(angle - curve.sweep_rad, 2 * M_PI);
      if (std::abs(change) <= reach) curve.sweep_rad = std::clamp(curve.sweep_rad + change, 1e-6, 2 * M_PI);
    } else if (std::abs(angle) <= reach && curve.sweep_rad - angle > 1e-6) {
      const Vec3 x = curve.x_axis, y = curve.y_axis;
      curve.x_axis = std::cos(angle) * x + std::sin(angle) * y;
      curve.y_axis = std::cos(angle) * y - std::sin(angle) * x;
      curve.sweep_rad = std::min(curve.sweep_rad - angle, 2 * M_PI);
    }
    return;
  }
  draft.end[size_t(which)] = to;
  if (curve.type == CurveType::kSpline) {
    found_.controls[size_t(curve.first_control + (which == 0 ? 0 : curve.control_count - 1))] = to;
  }
}

}  // namespace maq
