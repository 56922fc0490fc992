// Draws novelty and entropy: as red cells over an image, as a curve over time, and the events as text.
#pragma once

#include <app/prediction/live_prediction.h>
#include <deque>
#include <nlohmann/json.hpp>

#include "screen/window.h"

struct Reddening {
  float from_bits, full_bits, max_red;  // bits of a cell where red begins and is full; the most red
};

// Draws the cells of a square map over an image, the redder the more bits, interpolated between the cells.
void draw_red_cells(const std::vector<float>& bits, const Reddening& reddening, const Rect& image);

// Draws the bits of all frames on a logarithmic scale, the latest at the right; events as red lines.
void draw_novelty_curve(const std::deque<maquette::NoveltyMoment>& moments, const Rect& rect, float scale);

// Writes the latest frame's bits and the last events to the panel.
void draw_novelty_text(const maquette::PredictionFrame& frame, float scale);

nlohmann::ordered_json novelty_report(const maquette::PredictionFrame& frame);
