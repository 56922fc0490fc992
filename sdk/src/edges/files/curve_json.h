// The JSON of curves (docs/reference/formats.md): all parameters, so that no reader has to fit again.
#pragma once

#include <string>

#include "edges/curves/edge_curves.h"

namespace maq {

std::string curves_as_json(const EdgeCurves& curves);

// "crease" or "boundary"; "convex", "concave" or "unknown"; "line", "arc" or "spline".
const char* name_of(EdgeKind kind);
const char* name_of(Convexity convexity);
const char* name_of(CurveType type);

}  // namespace maq
