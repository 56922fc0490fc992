#include "edges/files/curve_json.h"

#include "core/json/json_text.h"
#include "edges/files/curve_text.h"

namespace maq {
namespace {

constexpr int kVersion = 1;

void write(JsonText& json, const char* name, Vec3 p) {
  if (name != nullptr) json.key(name);
  json.begin_list().value(p.x).value(p.y).value(p.z).end_list();
}

void write(JsonText& json, const char* name, const std::vector<Vec3>& points, int first, int count) {
  json.key(name).begin_list();
  for (int i = first; i < first + count; ++i) write(json, nullptr, points[size_t(i)]);
  json.end_list();
}

void write(JsonText& json, const EdgeCurves& curves, const EdgeCurve& curve) {
  json.begin_object().member("kind", name_of(curve.kind)).member("bend", name_of(curve.convexity));
  json.member("type", name_of(curve.type)).member("closed", curve.is_closed);
  json.key("corners").begin_list().value(curve.corner[0]).value(curve.corner[1]).end_list();
  json.member("length_m", curve.length_m).member("rms_r", curve.rms_footprints);
  if (curve.type == CurveType::kArc) {
    write(json, "centre", curve.centre);
    write(json, "x_axis", curve.x_axis);
    write(json, "y_axis", curve.y_axis);
    json.member("sweep_rad", curve.sweep_rad);
  }
  if (curve.type == CurveType::kSpline)
    write(json, "controls", curves.controls, curve.first_control, curve.control_count);
  write(json, "points", curves.points, curve.first_point, curve.point_count);
  json.key("planes").begin_list();
  for (size_t side = 0; side < 2; ++side) {
    if (curve.has_plane[side]) {
      json.begin_object();
      write(json, "normal", curve.plane[side].normal);
      json.member("offset_m", curve.plane[side].offset_m).end_object();
    } else {
      json.null();
    }
  }
  json.end_list().end_object();
}

}  // namespace

const char* name_of(EdgeKind kind) { return kind == kBoundaryEdge ? "boundary" : "crease"; }

const char* name_of(Convexity convexity) {
  return convexity == Convexity::kConvex ? "convex" : convexity == Convexity::kConcave ? "concave" : "unknown";
}

const char* name_of(CurveType type) {
  return type == CurveType::kLine ? "line" : type == CurveType::kArc ? "arc" : "spline";
}

std::string curves_as_json(const EdgeCurves& curves) {
  JsonText json(1);
  json.begin_object().member("version", kVersion).member("axes", axes_of(curves)).key("corners").begin_list();
  for (const EdgeCorner& corner : curves.corners) {
    json.begin_object();
    write(json, "point", corner.point);
    json.member("curves", corner.curve_count).end_object();
  }
  json.end_list().key("curves").begin_list();
  for (const EdgeCurve& curve : curves.curves) write(json, curves, curve);
  return json.end_list().end_object().text() + "\n";
}

}  // namespace maq
