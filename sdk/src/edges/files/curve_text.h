// What all text files of curves have in common.
#pragma once

#include <sstream>
#include <string>

#include "edges/curves/edge_curves.h"

namespace maq {

// Numbers of 9 digits with a point, whatever the app's locale.
std::ostringstream text_of_numbers();

// What the coordinates of curves mean.
std::string axes_of(const EdgeCurves& curves);

// The layer or group of a curve: its kind, and of a crease its bend where that is known.
std::string layer_of(const EdgeCurve& curve);

}  // namespace maq
