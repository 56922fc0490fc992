// Curves as files (docs/reference/formats.md).
#pragma once

#include <string>

#include "edges/curves/edge_curves.h"

namespace maq {

// Writes .json, .obj, .ply, .dxf or .step (.stp) by the extension of `path`, in small letters. The file appears
// atomically. Throws MAQ_ERROR_INVALID_ARGUMENT for another extension, and the errors of AtomicFile.
void write_curve_file(const EdgeCurves& curves, const std::string& path);

// Return the content of each format.
std::string curves_as_obj(const EdgeCurves& curves);
std::string curves_as_ply(const EdgeCurves& curves);
std::string curves_as_dxf(const EdgeCurves& curves);

}  // namespace maq
