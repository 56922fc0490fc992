#include "edges/files/curve_files.h"

#include <ostream>

#include "core/error.h"
#include "core/files/atomic_file.h"
#include "edges/files/curve_json.h"
#include "edges/files/curve_step.h"
#include "edges/files/curve_text.h"

namespace maq {
namespace {

void put_dxf_point(std::ostringstream& text, Vec3 p, int add = 0) {
  text << 10 + add << '\n' << p.x << '\n' << 20 + add << '\n' << p.y << '\n' << 30 + add << '\n' << p.z << '\n';
}

bool ends_with(const std::string& path, const char* ending) {
  const std::string text(ending);
  return path.size() >= text.size() && path.compare(path.size() - text.size(), text.size(), text) == 0;
}

}  // namespace

std::string curves_as_obj(const EdgeCurves& curves) {
  std::ostringstream text = text_of_numbers();
  text << "# sharp feature curves, " << axes_of(curves) << '\n';
  for (const Vec3& p : curves.points) text << "v " << p.x << ' ' << p.y << ' ' << p.z << '\n';
  for (size_t i = 0; i < curves.curves.size(); ++i) {
    const EdgeCurve& curve = curves.curves[i];
    text << "g " << layer_of(curve) << "\nl";
    for (int k = 0; k < curve.point_count; ++k) text << ' ' << curve.first_point + k + 1;
    text << '\n';
  }
  return text.str();
}

std::string curves_as_ply(const EdgeCurves& curves) {
  size_t edges = 0;
  for (const EdgeCurve& curve : curves.curves) edges += size_t(curve.point_count - 1);
  std::ostringstream text = text_of_numbers();
  text << "ply\nformat ascii 1.0\ncomment sharp feature curves, " << axes_of(curves) << "\nelement vertex "
       << curves.points.size() << "\nproperty double x\nproperty double y\nproperty double z\nelement edge " << edges
       << "\nproperty int vertex1\nproperty int vertex2\nproperty uchar kind\nend_header\n";
  for (const Vec3& p : curves.points) text << p.x << ' ' << p.y << ' ' << p.z << '\n';
  for (const EdgeCurve& curve : curves.curves) {
    for (int k = 0; k + 1 < curve.point_count; ++k) {
      text << curve.first_point + k << ' ' << curve.first_point + k + 1 << ' ' << int(curve.kind) << '\n';
    }
  }
  return text.str();
}

// Release 12 has no arcs or splines in space: they become polylines. Entities alone make a complete file.
std::string curves_as_dxf(const EdgeCurves& curves) {
  std::ostringstream text = text_of_numbers();
  text << "0\nSECTION\n2\nENTITIES\n";
  for (const EdgeCurve& curve : curves.curves) {
    const std::string layer = layer_of(curve);
    const Vec3* points = &curves.points[size_t(curve.first_point)];
    if (curve.point_count == 2) {
      text << "0\nLINE\n8\n" << layer << '\n';
      put_dxf_point(text, points[0]);
      put_dxf_point(text, points[1], 1);
      continue;
    }
    text << "0\nPOLYLINE\n8\n" << layer << "\n66\n1\n70\n8\n";
    put_dxf_point(text, Vec3{});
    for (int k = 0; k < curve.point_count; ++k) {
      text << "0\nVERTEX\n8\n" << layer << '\n';
      put_dxf_point(text, points[k]);
      text << "70\n32\n";
    }
    text << "0\nSEQEND\n8\n" << layer << '\n';
  }
  text << "0\nENDSEC\n0\nEOF\n";
  return text.str();
}

void write_curve_file(const EdgeCurves& curves, const std::string& path) {
  std::string (*make)(const EdgeCurves&) = nullptr;
  if (ends_with(path, ".json")) make = curves_as_json;
  if (ends_with(path, ".obj")) make = curves_as_obj;
  if (ends_with(path, ".ply")) make = curves_as_ply;
  if (ends_with(path, ".dxf")) make = curves_as_dxf;
  if (ends_with(path, ".step") || ends_with(path, ".stp")) make = curves_as_step;
  if (make == nullptr) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "Curves cannot be written as \"", path,
                "\": its ending must be .json, .obj, .ply, .dxf or .step.");
  }
  AtomicFile file(path);
  const std::string text = make(curves);
  file.append(text.data(), text.size());
  file.commit();
}

}  // namespace maq
