// Common parts of the text files of curves.
#pragma once

#include <sstream>
#include <string>

#include "edges/curves/edge_curves.h"

namespace maq {

// Writes numbers with 9 digits and a point in any locale.
std::ostringstream text_of_numbers();

// Returns the meaning of the coordinates in words.
std::string axes_of(const EdgeCurves& curves);

// Returns the layer or group of a curve: its kind, and for a crease its convexity if known.
std::string layer_of(const EdgeCurve& curve);

}  // namespace maq
