#include "edges/files/curve_json.h"

#include <nlohmann/json.hpp>

#include "core/memory.h"
#include "edges/files/curve_text.h"

namespace maq {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kVersion = 1;
constexpr size_t kBytesOfCurve = 4096, kBytesOfPoint = 512;  // upper limits of the document's memory

Json json_of(Vec3 p) { return {p.x, p.y, p.z}; }

Json json_of(const std::vector<Vec3>& points, int first, int count) {
  Json list = Json::array();
  for (int i = first; i < first + count; ++i) list.push_back(json_of(points[size_t(i)]));
  return list;
}

Json json_of(const EdgeCurves& curves, const EdgeCurve& curve) {
  Json made;
  made["kind"] = name_of(curve.kind);
  made["bend"] = name_of(curve.convexity);
  made["type"] = name_of(curve.type);
  made["closed"] = curve.is_closed;
  made["corners"] = curve.corner;
  made["length_m"] = curve.length_m;
  made["rms_r"] = curve.rms_footprints;
  if (curve.type == CurveType::kArc) {
    made["centre"] = json_of(curve.centre);
    made["x_axis"] = json_of(curve.x_axis);
    made["y_axis"] = json_of(curve.y_axis);
    made["sweep_rad"] = curve.sweep_rad;
  }
  if (curve.type == CurveType::kSpline)
    made["controls"] = json_of(curves.controls, curve.first_control, curve.control_count);
  made["points"] = json_of(curves.points, curve.first_point, curve.point_count);
  made["planes"] = Json::array();
  for (size_t side = 0; side < 2; ++side) {
    if (curve.has_plane[side]) {
      made["planes"].push_back(
          {{"normal", json_of(curve.plane[side].normal)}, {"offset_m", curve.plane[side].offset_m}});
    } else {
      made["planes"].push_back(nullptr);
    }
  }
  return made;
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
  // The JSON library ends the process when an allocation fails.
  require_memory(kBytesOfCurve * (1 + curves.curves.size() + curves.corners.size()) +
                 kBytesOfPoint * (curves.points.size() + curves.controls.size()));
  Json document;
  document["version"] = kVersion;
  document["axes"] = axes_of(curves);
  document["corners"] = Json::array();
  for (const EdgeCorner& corner : curves.corners) {
    document["corners"].push_back({{"point", json_of(corner.point)}, {"curves", corner.curve_count}});
  }
  document["curves"] = Json::array();
  for (const EdgeCurve& curve : curves.curves) document["curves"].push_back(json_of(curves, curve));
  return document.dump(1) + "\n";
}

}  // namespace maq
