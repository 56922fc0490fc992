#include <cmath>

#include "api/boundary.h"
#include "api/edges/edges_handle.h"
#include "core/clock.h"
#include "edges/files/curve_files.h"
#include "edges/measuring/snap.h"

using namespace maq;

namespace {

constexpr double kMaxRadiusPx = 1e6;

// The app reads points as triples of doubles.
static_assert(sizeof(Vec3) == 3 * sizeof(double));
// The enums of the engine and of the C API have the same values.
static_assert(int(CurveType::kSpline) == MAQ_EDGES_CURVE_SPLINE && int(CurveType::kArc) == MAQ_EDGES_CURVE_ARC);
static_assert(int(Convexity::kConvex) == MAQ_EDGES_CONVEXITY_CONVEX &&
              int(Convexity::kConcave) == MAQ_EDGES_CONVEXITY_CONCAVE);
static_assert(int(SnapTarget::kCorner) == MAQ_EDGES_SNAP_CORNER && int(SnapTarget::kEdge) == MAQ_EDGES_SNAP_CURVE &&
              int(SnapTarget::kPlane) == MAQ_EDGES_SNAP_PLANE);

maq_edges_curves_config default_curves_config() {
  maq_edges_curves_config config{};
  config.struct_size = sizeof config;
  return config;
}

void write_vector(Vec3 from, double* to) { to[0] = from.x, to[1] = from.y, to[2] = from.z; }

// Returns NULL if `count` is 0.
const double* doubles_of(const std::vector<Vec3>& points, int first, int count) {
  return count > 0 ? &points[size_t(first)].x : nullptr;
}

void write_snap(const Snap& from, maq_edges_snap* snap) {
  maq_edges_snap filled{};
  filled.target = maq_edges_snap_target(from.target);
  filled.index = from.index;
  filled.adjacent_plane_index = from.side;
  write_vector(from.point, filled.point_m);
  filled.distance_px = from.distance_px;
  filled.angle_rad = from.angle_rad;
  write_struct(snap, "snap", filled);
}

Vec3 read_vector(const double* from, const char* name) {
  require_argument(from, name);
  const Vec3 read{from[0], from[1], from[2]};
  if (!is_finite(read)) {
    throw ArgumentError(name, " is (", read.x, ", ", read.y, ", ", read.z, "), but must be finite.");
  }
  return read;
}

}  // namespace

void CurveFinder::find(const EdgeField& field, const CurveRequest& request, FoundCurves& found) {
  Stopwatch stage;
  extractor_.set_options(request.options);
  found.curves = extractor_.extract(field);
  found.curves_ms = float(stage.lap_ms());
  found.boxes.clear();
  if (request.finds_boxes) box_finder_.find(field, found.boxes, request.focal_tolerance);
  found.includes_focal_tolerance = request.focal_tolerance > 0;
  found.boxes_ms = request.finds_boxes ? float(stage.lap_ms()) : 0;
  found.seen.width = field.width;
  found.seen.height = field.height;
  found.seen.intrinsics = field.intrinsics;
  found.seen.depth_m = field.depth_m;
}

CurveRequest maq::curve_request(const maq_edges_curves_config* given, const char* name) {
  const maq_edges_curves_config config = read_config(given, name, default_curves_config());
  require_range(concatenate(name, ".skip_boxes"), config.skip_boxes, 0, 1);
  CurveRequest request;
  request.finds_boxes = config.skip_boxes == 0;
  require_range(concatenate(name, ".focal_tolerance"), config.focal_tolerance, 0.0f, 0.5f);
  request.focal_tolerance = double(config.focal_tolerance);
  if (config.min_length_px != 0) request.options.min_length_px = config.min_length_px;
  (void)CurveExtractor(request.options);  // checks them
  return request;
}

maq_status maq_edges_curves_config_init(maq_edges_curves_config* config, uint32_t struct_size) {
  return init_config(__func__, config, struct_size, default_curves_config());
}

maq_status maq_edges_result_find_curves(const maq_edges_result* result, const maq_edges_curves_config* config,
                                        maq_edges_curves** curves) {
  return guarded(result, __func__, [&] {
    require_argument(result, "result");
    require_argument(curves, "curves");
    const CurveRequest request = curve_request(config, "config");
    BoundedPool<maq_edges_curves>::Pooled handle = result->curves->acquire();
    handle->finder.find(result->result.field, request, handle->found);
    *curves = lend<maq_edges_curves>(std::move(handle));
    return MAQ_OK;
  });
}

void maq_edges_curves_release(maq_edges_curves* curves) {
  return_handle(curves, "curves", __func__, return_to_pool<maq_edges_curves>);
}

uint32_t maq_edges_curves_get_curve_count(const maq_edges_curves* curves) {
  return curves == nullptr ? 0 : uint32_t(curves->found.curves.curves.size());
}

uint32_t maq_edges_curves_get_corner_count(const maq_edges_curves* curves) {
  return curves == nullptr ? 0 : uint32_t(curves->found.curves.corners.size());
}

uint32_t maq_edges_curves_get_box_count(const maq_edges_curves* curves) {
  return curves == nullptr ? 0 : uint32_t(curves->found.boxes.size());
}

maq_status maq_edges_curves_get_curve(const maq_edges_curves* curves, uint32_t index, maq_edges_curve* curve) {
  return guarded(curves, __func__, [&] {
    require_argument(curves, "curves");
    const EdgeCurves& all = curves->found.curves;
    require_index("index", index, all.curves.size());
    const EdgeCurve& from = all.curves[index];
    maq_edges_curve filled{};
    filled.type = maq_edges_curve_type(from.type);
    filled.kind = maq_edges_kind(from.kind);
    filled.convexity = maq_edges_convexity(from.convexity);
    filled.is_closed = from.is_closed ? 1 : 0;
    filled.length_m = from.length_m;
    filled.rms_footprints = from.rms_footprints;
    filled.points_m = doubles_of(all.points, from.first_point, from.point_count);
    filled.point_count = uint32_t(from.point_count);
    filled.controls_m = doubles_of(all.controls, from.first_control, from.control_count);
    filled.control_count = uint32_t(from.control_count);
    if (from.type == CurveType::kArc) {
      write_vector(from.centre, filled.centre_m);
      write_vector(from.x_axis, filled.x_axis_m);
      write_vector(from.y_axis, filled.y_axis_m);
      filled.sweep_rad = from.sweep_rad;
    }
    for (size_t i = 0; i < 2; ++i) {
      filled.corners[i] = from.corner[i];
      if (!from.has_plane[i]) continue;
      filled.adjacent_planes[i].is_known = 1;
      write_vector(from.plane[i].normal, filled.adjacent_planes[i].normal);
      filled.adjacent_planes[i].offset_m = from.plane[i].offset_m;
    }
    write_struct(curve, "curve", filled);
    return MAQ_OK;
  });
}

maq_status maq_edges_curves_get_corner(const maq_edges_curves* curves, uint32_t index, maq_edges_corner* corner) {
  return guarded(curves, __func__, [&] {
    require_argument(curves, "curves");
    require_index("index", index, curves->found.curves.corners.size());
    const EdgeCorner& from = curves->found.curves.corners[index];
    maq_edges_corner filled{};
    filled.curve_count = from.curve_count;
    write_vector(from.point, filled.point_m);
    write_struct(corner, "corner", filled);
    return MAQ_OK;
  });
}

maq_status maq_edges_curves_get_box(const maq_edges_curves* curves, uint32_t index, maq_edges_box* box) {
  return guarded(curves, __func__, [&] {
    require_argument(curves, "curves");
    require_index("index", index, curves->found.boxes.size());
    const MeasuredBox& from = curves->found.boxes[index];
    maq_edges_box filled{};
    filled.corner_count = from.corners;
    filled.includes_focal_tolerance = curves->found.includes_focal_tolerance ? 1 : 0;
    write_vector(from.centre, filled.centre_m);
    for (size_t i = 0; i < 3; ++i) {
      filled.size_m[i] = from.size_m[i];
      filled.size_tolerance_m[i] = from.size_tolerance_m[i];
      write_vector(from.axis[i], filled.axes[i]);
    }
    write_struct(box, "box", filled);
    return MAQ_OK;
  });
}

maq_status maq_edges_curves_get_stats(const maq_edges_curves* curves, maq_edges_curves_stats* stats) {
  return guarded(curves, __func__, [&] {
    require_argument(curves, "curves");
    const CurveCounts& from = curves->found.curves.counts;
    maq_edges_curves_stats filled{};
    filled.curves_ms = curves->found.curves_ms;
    filled.boxes_ms = curves->found.boxes_ms;
    filled.bad_pixel_count = from.bad_pixels;
    filled.voting_pixel_count = from.voting_pixels;
    filled.chain_count = from.chains;
    filled.short_chain_count = from.short_chains;
    filled.without_depth_count = from.without_depth;
    filled.not_fitted_count = from.not_fitted;
    filled.over_limit_count = from.over_limit;
    write_struct(stats, "stats", filled);
    return MAQ_OK;
  });
}

maq_status maq_edges_curves_snap_to_pixel(const maq_edges_curves* curves, double x_px, double y_px, double radius_px,
                                          maq_edges_snap* snap) {
  return guarded(curves, __func__, [&] {
    require_argument(curves, "curves");
    require_range("radius_px", radius_px, 0.0, kMaxRadiusPx);
    if (curves->found.seen.width == 0) {
      throw ArgumentError(
          "curves come from a fusion of several views, which have no common pixels; use "
          "maq_edges_curves_snap_to_ray.");
    }
    write_snap(snap_to(curves->found.seen, curves->found.curves, x_px, y_px, radius_px), snap);
    return MAQ_OK;
  });
}

maq_status maq_edges_curves_snap_to_ray(const maq_edges_curves* curves, const double origin_m[3],
                                        const double direction[3], double max_angle_rad, maq_edges_snap* snap) {
  return guarded(curves, __func__, [&] {
    require_argument(curves, "curves");
    const Vec3 from = read_vector(origin_m, "origin_m"), along = read_vector(direction, "direction");
    if (!(length(along) > 0) || !std::isfinite(length(along))) {
      throw ArgumentError("direction has the length ", length(along), ", but must be longer than 0 and finite.");
    }
    require_range("max_angle_rad", max_angle_rad, 0.0, 1.0);
    write_snap(snap_to_ray(curves->found.seen, curves->found.curves, from, along, max_angle_rad), snap);
    return MAQ_OK;
  });
}

maq_status maq_edges_curves_save(const maq_edges_curves* curves, const char* path) {
  return guarded(curves, __func__, [&] {
    require_argument(curves, "curves");
    require_argument(path, "path");
    write_curve_file(curves->found.curves, path);
    return MAQ_OK;
  });
}
