// Bits of the cells of a frame, drawn over its picture: the more bits, the redder.
#pragma once

#include <vector>

#include "screen/window.h"

struct Reddening {
  float from_bits = 0, full_bits = 0;  // where red begins, and where it is full
  float max_red = 0.7f;                // of what is drawn then
};

// `bits`: rows of `columns` cells; empty: nothing is drawn. Colours change smoothly between the middles of the cells,
// and not beyond the outer ones'.
void draw_red_cells(const std::vector<float>& bits, int columns, const Reddening& reddening, const Rect& picture);
