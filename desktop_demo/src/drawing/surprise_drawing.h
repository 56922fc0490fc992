// How surprising a source is, and how uncertain what comes, drawn: where, over a picture; when, as a curve; and the
// events as text.
#pragma once

#include <app/prediction/live_prediction.h>
#include <deque>
#include <nlohmann/json.hpp>

#include "screen/window.h"

struct Reddening {
  float from_bits, full_bits, max_red;  // of a cell: where red begins, where it is full, and how much it is then
};

// Bits of square maps' cells over a picture: the more, the redder, smooth between the middles of the cells.
void draw_red_cells(const std::vector<float>& bits, const Reddening& reddening, const Rect& picture);

// Bits of the frames so far, logarithmic, the latest at the right; events as red lines.
void draw_surprise_curve(const std::deque<maquette::SurpriseMoment>& moments, const Rect& rect, float scale);

// In the panel: the latest frame's bits and the last events.
void draw_surprise_text(const maquette::PredictionFrame& frame, float scale);

nlohmann::ordered_json surprise_report(const maquette::PredictionFrame& frame);
