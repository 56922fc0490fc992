#include "edges/fusion/curve_fusion.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <unordered_map>

#include "edges/curves/curve_drawing.h"

namespace maq {
namespace {

constexpr double kPlaceStep_r = 1;  // distance between samples of a curve
constexpr int kMaxSteps = 20000;    // along one curve, and as many for its extension
constexpr double kTurn_rad = 6.283185307179586;
constexpr double kBeside = 1.3;  // times match_r: other pieces this near a fused curve belong to it
// A curve is a crease if a quarter of its samples are: in the rest one side was hidden.
constexpr double kCreaseFraction = 0.25;

Vec3 in_world(const PinholeCamera& camera, Vec3 d) {
  const auto& r = camera.rotation;
  return {r[0] * d.x + r[3] * d.y + r[6] * d.z, r[1] * d.x + r[4] * d.y + r[7] * d.z,
          r[2] * d.x + r[5] * d.y + r[8] * d.z};
}

struct Spot {
  Vec3 point, direction;
};

}  // namespace

void CurveFusion::add_view(const EdgeCurves& curves, const PinholeCamera& pose) {
  const auto view = int(centres_.size());
  centres_.push_back(pose.centre);
  const double focal = focal_px(pose);
  for (const EdgeCurve& curve : curves.curves) {
    Piece piece{places_.size(), 0, 0, curve.is_closed};
    for (int i = 0; i + 1 < curve.point_count; ++i) {
      const Vec3 a = curves.points[size_t(curve.first_point + i)];
      const Vec3 d = curves.points[size_t(curve.first_point + i) + 1] - a;
      const double r_m = std::max(a.z + 0.5 * d.z, 1e-12) / focal, size_r = length(d) / r_m;
      const auto steps = int(std::clamp(std::ceil(size_r / kPlaceStep_r), 1.0, double(kMaxSteps)));
      for (int k = 0; k < steps; ++k) {
        const Vec3 p = a + ((k + 0.5) / steps) * d;
        if (!is_finite(p) || !(p.z > 0)) continue;
        places_.push_back(
            {in_world(pose, p), in_world(pose, normalized(d)), p.z / focal, view, curve.kind, curve.convexity});
      }
      piece.length_r += size_r;
    }
    piece.count = places_.size() - piece.first;
    if (piece.count > 1) pieces_.push_back(piece);
  }
}

// The work of one fusion: pieces one by one, the longest first. Each piece absorbs pieces of other views beside it.
class CurveFusion::Merger {
 public:
  Merger(const CurveFusion& from, const std::array<double, 3>& origin, EdgeCurves& result)
      : options_(from.options_),
        result_(result),
        pieces_(from.pieces_),
        places_(from.places_),
        min_views_(from.centres_.size() > 2 ? options_.min_views : 1),
        cosine_(std::cos(options_.match_deg * kTurn_rad / 360)) {
    double largest = 0;
    for (Place& place : places_) {
      const auto& c = from.centres_[size_t(place.view)];
      place.point = place.point + Vec3{c[0] - origin[0], c[1] - origin[1], c[2] - origin[2]};
      largest = std::max(largest, place.r_m);
    }
    cell_m_ = std::max(kBeside * options_.match_r * largest, 1e-12);
    for (size_t i = 0; i < places_.size(); ++i) cells_[key_of(places_[i].point)].push_back(i);
    is_taken_.assign(places_.size(), 0);
    round_of_.assign(places_.size(), 0);
    // The order of pieces matters, so it must not depend on the order of views.
    std::sort(pieces_.begin(), pieces_.end(), [&](const Piece& a, const Piece& b) {
      if (a.length_r != b.length_r) return a.length_r > b.length_r;
      const Vec3 p = places_[a.first].point, q = places_[b.first].point;
      return std::array{p.x, p.y, p.z} < std::array{q.x, q.y, q.z};
    });
  }

  void run() {
    for (const Piece& piece : pieces_) {
      size_t first = piece.first;
      const size_t last = piece.first + piece.count;
      while (first < last) {
        size_t end = first;
        while (end < last && is_taken_[end] == 0) ++end;
        if (double(end - first) * kPlaceStep_r >= options_.min_length_r) fuse_run(first, end);
        first = end + 1;
      }
    }
    join();
  }

 private:
  struct Draft {
    EdgeCurve curve;
    std::array<Vec3, 2> end, outward;
    double r_m;
  };
  struct Found {
    size_t place;
    double along_m;
  };

  uint64_t key_of(Vec3 p, int dx = 0, int dy = 0, int dz = 0) const {
    const auto whole = [&](double v, int d) {
      return uint64_t(int64_t(std::clamp(std::floor(v / cell_m_), -1e6, 1e6)) + d + (1 << 20)) & ((1 << 21) - 1);
    };
    return whole(p.x, dx) | whole(p.y, dy) << 21 | whole(p.z, dz) << 42;
  }

  // Calls visit(index) for points near a position with the same direction, within `reach` footprints of the larger of
  // both.
  template <class Visit>
  void visit_beside(const Spot& spot, double r_m, double reach, Visit visit) {
    for (int dz = -1; dz <= 1; ++dz) {
      for (int dy = -1; dy <= 1; ++dy) {
        for (int dx = -1; dx <= 1; ++dx) {
          const auto cell = cells_.find(key_of(spot.point, dx, dy, dz));
          if (cell == cells_.end()) continue;
          for (const size_t i : cell->second) {
            const Place& place = places_[i];
            if (length(place.point - spot.point) > reach * std::max(r_m, place.r_m)) continue;
            if (std::abs(dot(place.direction, spot.direction)) >= cosine_) visit(i);
          }
        }
      }
    }
  }

  bool collect(const Spot& spot, double r_m, double along_m) {
    const size_t before = found_.size();
    visit_beside(spot, r_m, options_.match_r, [&](size_t i) {
      if (is_taken_[i] != 0 || round_of_[i] == round_) return;
      round_of_[i] = round_;
      found_.push_back({i, along_m + dot(places_[i].point - spot.point, spot.direction)});
    });
    return found_.size() > before;
  }

  // Along a curve, at(s) its spot after s metres, from 0 to `length_m`, and on beyond both ends while there is more.
  template <class At>
  void gather(At at, double length_m, double r_m, double longest_m, bool grows) {
    found_.clear();
    ++round_;
    const double step = options_.match_r * r_m / 2, gap = options_.gap_r * r_m;
    const int steps = std::min(kMaxSteps, int(std::ceil(length_m / step)));
    for (int k = 0; k <= steps; ++k) collect(at(std::min(length_m, k * step)), r_m, std::min(length_m, k * step));
    if (!grows) return;
    for (const int sign : {-1, 1}) {
      double reached = 0;
      for (int k = 1; k < kMaxSteps && k * step - reached <= gap && length_m + k * step < longest_m; ++k) {
        const double s = sign < 0 ? -k * step : length_m + k * step;
        if (collect(at(s), r_m, s)) reached = k * step;
      }
    }
  }

  void fill_points() {
    std::sort(found_.begin(), found_.end(), [](const Found& a, const Found& b) { return a.along_m < b.along_m; });
    points_.clear();
    for (const Found& found : found_) points_.push_back({places_[found.place].point, places_[found.place].r_m, 1});
  }

  void fuse_run(size_t first, size_t end) {
    points_.clear();
    double r_m = 0;
    for (size_t i = first; i < end; ++i) {
      points_.push_back({places_[i].point, places_[i].r_m, 1});
      r_m += places_[i].r_m / double(end - first);
    }
    Draft draft{};
    draft.r_m = r_m;
    if (!fit_as_line(draft) && !fit_as_arc(first, end, draft) && !fit_as_spline(first, end, draft)) {
      for (size_t i = first; i < end; ++i) is_taken_[i] = 1;
      return;
    }
    std::set<int> views;
    size_t creases = 0, convex = 0, concave = 0;
    for (const Found& found : found_) {
      const Place& place = places_[found.place];
      is_taken_[found.place] = 1;
      views.insert(place.view);
      creases += place.kind == kCreaseEdge ? 1 : 0;
      convex += place.convexity == Convexity::kConvex ? 1 : 0;
      concave += place.convexity == Convexity::kConcave ? 1 : 0;
    }
    for (size_t i = first; i < end; ++i) is_taken_[i] = 1;
    for (const size_t i : beside_) is_taken_[i] = 1;
    if (int(views.size()) < min_views_) return;
    EdgeCurve& curve = draft.curve;
    curve.kind = double(creases) >= kCreaseFraction * double(found_.size()) ? kCreaseEdge : kBoundaryEdge;
    if (curve.kind == kCreaseEdge && convex != concave)
      curve.convexity = convex > concave ? Convexity::kConvex : Convexity::kConcave;
    drafts_.push_back(draft);
  }

  // Absorbs pieces along a fused curve, within a slightly larger distance than its own samples.
  template <class At>
  void note_beside(At at, double length_m, double r_m) {
    beside_.clear();
    const double step = options_.match_r * r_m / 2;
    const int steps = std::min(kMaxSteps, int(std::ceil(length_m / step)));
    for (int k = 0; k <= steps; ++k) {
      visit_beside(at(std::min(length_m, k * step)), r_m, kBeside * options_.match_r,
                   [&](size_t i) { beside_.push_back(i); });
    }
  }

  bool fit_as_line(Draft& draft) {
    auto line = fit_line(points_.data(), points_.size());
    if (!line || !(line->rms <= options_.tolerance_r)) return false;
    for (int round = 0; round < 2; ++round) {
      const Vec3 from = line->from, direction = normalized(line->to - line->from);
      gather(
          [&](double s) {
            return Spot{from + s * direction, direction};
          },
          length(line->to - from), draft.r_m, std::numeric_limits<double>::infinity(), true);
      fill_points();
      const auto better = fit_line(points_.data(), points_.size());
      if (!better) return false;
      line = better;
    }
    const Vec3 direction = normalized(line->to - line->from);
    const auto [low, high] = extent_of_views(line->from, direction);
    draft.end = {line->from + low * direction, line->from + high * direction};
    if (!(high - low >= options_.min_length_r * draft.r_m)) return false;
    draft.outward = {-direction, direction};
    draft.curve.type = CurveType::kLine;
    draft.curve.rms_footprints = line->rms;
    const Vec3 from = line->from;
    note_beside([&](double s) { return Spot{from + s * direction, direction}; }, length(line->to - from), draft.r_m);
    return true;
  }

  // From where to where views saw the line: of three views and more without the one that says most at each end.
  std::pair<double, double> extent_of_views(Vec3 from, Vec3 direction) const {
    std::unordered_map<int, std::pair<double, double>> of_view;
    for (const Found& found : found_) {
      const double t = dot(places_[found.place].point - from, direction);
      auto [own, is_new] = of_view.insert({places_[found.place].view, {t, t}});
      if (!is_new) own->second = {std::min(own->second.first, t), std::max(own->second.second, t)};
    }
    std::vector<double> low, high;
    for (const auto& [view, own] : of_view) low.push_back(own.first), high.push_back(own.second);
    std::sort(low.begin(), low.end());
    std::sort(high.rbegin(), high.rend());
    const size_t which = low.size() > 2 ? 1 : 0;
    return {low[which], high[which]};
  }

  bool fit_as_arc(size_t first, size_t end, Draft& draft) {
    auto arc = arc_fitter_.fit(points_.data(), points_.size());
    if (!arc || !(arc->rms <= options_.tolerance_r)) return false;
    for (int round = 0; round < 2; ++round) {
      const double radius = length(arc->x_axis);
      const ArcFit now = *arc;
      gather(
          [&](double s) {
            const double a = s / radius;
            return Spot{now.centre + std::cos(a) * now.x_axis + std::sin(a) * now.y_axis,
                        (1 / radius) * (std::cos(a) * now.y_axis - std::sin(a) * now.x_axis)};
          },
          now.sweep_rad * radius, draft.r_m, kTurn_rad * radius, true);
      fill_points();
      const auto better = arc_fitter_.fit(points_.data(), points_.size());
      if (!better || !(better->rms <= 1.5 * options_.tolerance_r)) return restore(first, end);
      arc = better;
    }
    const double radius = length(arc->x_axis);
    EdgeCurve& curve = draft.curve;
    curve.type = CurveType::kArc;
    curve.centre = arc->centre, curve.x_axis = arc->x_axis, curve.y_axis = arc->y_axis;
    curve.is_closed = (kTurn_rad - arc->sweep_rad) * radius < options_.gap_r * draft.r_m;
    curve.sweep_rad = curve.is_closed ? kTurn_rad : arc->sweep_rad;
    curve.rms_footprints = arc->rms;
    if (!(curve.sweep_rad * radius >= options_.min_length_r * draft.r_m)) return restore(first, end);
    const auto spot = [&](double s) {
      const double a = s / radius;
      return Spot{curve.centre + std::cos(a) * curve.x_axis + std::sin(a) * curve.y_axis,
                  (1 / radius) * (std::cos(a) * curve.y_axis - std::sin(a) * curve.x_axis)};
    };
    const Spot from = spot(0), to = spot(curve.sweep_rad * radius);
    draft.end = {from.point, to.point};
    draft.outward = {-from.direction, to.direction};
    note_beside(spot, curve.sweep_rad * radius, draft.r_m);
    return true;
  }

  // False, with the run's own points again.
  bool restore(size_t first, size_t end) {
    points_.clear();
    for (size_t i = first; i < end; ++i) points_.push_back({places_[i].point, places_[i].r_m, 1});
    return false;
  }

  bool fit_as_spline(size_t first, size_t end, Draft& draft) {
    const double step = kPlaceStep_r * draft.r_m;
    const auto spot = [&](double s) {
      const Place& place = places_[std::min(first + size_t(std::max(0.0, s / step)), end - 1)];
      return Spot{place.point, place.direction};
    };
    const double size = step * double(end - first - 1);
    gather(spot, size, draft.r_m, size, false);
    fill_points();
    const auto rms = spline_fitter_.fit(points_.data(), points_.size(), false, options_.tolerance_r);
    if (!rms || !(*rms <= 2 * options_.tolerance_r)) return false;
    const std::vector<Vec3>& controls = spline_fitter_.controls();
    EdgeCurve& curve = draft.curve;
    curve.type = CurveType::kSpline;
    curve.rms_footprints = *rms;
    curve.first_control = int(result_.controls.size());
    curve.control_count = int(controls.size());
    result_.controls.insert(result_.controls.end(), controls.begin(), controls.end());
    const size_t n = controls.size();
    draft.end = {controls[0], controls[n - 1]};
    draft.outward = {normalized(controls[0] - controls[1]), normalized(controls[n - 1] - controls[n - 2])};
    note_beside(spot, size, draft.r_m);
    return true;
  }

  void join() {
    if (drafts_.size() > size_t(options_.max_curves)) {
      result_.counts.over_limit = int(drafts_.size()) - options_.max_curves;
      drafts_.resize(size_t(options_.max_curves));
    }
    std::vector<CurveEnd> ends;
    for (size_t i = 0; i < drafts_.size(); ++i) {
      const Draft& draft = drafts_[i];
      if (draft.curve.is_closed) continue;
      for (int k = 0; k < 2; ++k) {
        ends.push_back({int(i), k, draft.end[size_t(k)], draft.outward[size_t(k)], draft.r_m, draft.r_m});
      }
    }
    CornerFinder().find(ends, options_.join_r, result_.corners);
    for (const CurveEnd& end : ends) {
      Draft& draft = drafts_[size_t(end.curve)];
      EdgeCurve& curve = draft.curve;
      curve.corner[size_t(end.which)] = end.corner;
      if (end.corner < 0 || curve.type == CurveType::kArc) continue;
      const Vec3 corner = result_.corners[size_t(end.corner)].point;
      draft.end[size_t(end.which)] = corner;
      if (curve.type == CurveType::kSpline) {
        result_.controls[size_t(curve.first_control + (end.which == 0 ? 0 : curve.control_count - 1))] = corner;
      }
    }
    for (const Draft& draft : drafts_) append_curve(draft.curve, draft.end, result_);
  }

  const CurveFusionOptions& options_;
  EdgeCurves& result_;
  std::vector<Piece> pieces_;
  std::vector<Place> places_;
  int min_views_;
  double cosine_, cell_m_ = 1;
  std::unordered_map<uint64_t, std::vector<size_t>> cells_;
  std::vector<uint8_t> is_taken_;
  std::vector<uint32_t> round_of_;
  uint32_t round_ = 0;
  std::vector<Found> found_;
  std::vector<size_t> beside_;
  std::vector<FitPoint> points_;
  std::vector<Draft> drafts_;
  ArcFitter arc_fitter_;
  SplineFitter spline_fitter_;
};

void CurveFusion::fuse(const std::array<double, 3>& origin, EdgeCurves& result) const {
  result = {};
  result.in_world = true;
  Merger(*this, origin, result).run();
  const Vec3 o{origin[0], origin[1], origin[2]};
  for (EdgeCurve& curve : result.curves) {
    if (curve.type == CurveType::kArc) curve.centre = curve.centre + o;
  }
  for (EdgeCorner& corner : result.corners) corner.point = corner.point + o;
  for (std::vector<Vec3>* points : {&result.points, &result.controls}) {
    for (Vec3& p : *points) p = p + o;
  }
}

}  // namespace maq
