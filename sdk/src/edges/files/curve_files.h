// Curves as files (docs/formats.md).
#pragma once

#include <string>

#include "edges/curves/edge_curves.h"

namespace maq {

// Writes .json, .obj, .ply, .dxf or .step (.stp), by the ending of `path` in small letters; it appears atomically.
// Throws MAQ_ERROR_INVALID_ARGUMENT for another ending, and what AtomicFile throws.
void write_curve_file(const EdgeCurves& curves, const std::string& path);

// What each has written in it.
std::string curves_as_obj(const EdgeCurves& curves);
std::string curves_as_ply(const EdgeCurves& curves);
std::string curves_as_dxf(const EdgeCurves& curves);

}  // namespace maq
