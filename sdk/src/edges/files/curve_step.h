// Curves as STEP (ISO 10303-21, AP214): a geometrically bounded wireframe of lines, circles and B-splines, exactly.
#pragma once

#include <string>

#include "edges/curves/edge_curves.h"

namespace maq {

std::string curves_as_step(const EdgeCurves& curves);

}  // namespace maq
