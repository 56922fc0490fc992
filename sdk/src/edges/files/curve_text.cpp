#include "edges/files/curve_text.h"

#include <locale>

namespace maq {

std::ostringstream text_of_numbers() {
  std::ostringstream text;
  text.exceptions(std::ios::badbit);  // throws without memory; otherwise the text would end early
  text.imbue(std::locale::classic());
  text.precision(9);
  return text;
}

std::string axes_of(const EdgeCurves& curves) {
  return curves.in_world ? "metres; in the world of the cameras" : "metres; x right, y down, z along the optical axis";
}

std::string layer_of(const EdgeCurve& curve) {
  std::string name = curve.kind == kBoundaryEdge ? "BOUNDARY" : "CREASE";
  if (curve.convexity == Convexity::kConvex) name += "_CONVEX";
  if (curve.convexity == Convexity::kConcave) name += "_CONCAVE";
  return name;
}

}  // namespace maq
