// Draws camera health and entropy: as red cells over an image, as a curve over time, and the events as text.
#pragma once

#include <app/prediction/live_prediction.h>
#include <deque>
#include <nlohmann/json.hpp>

#include "screen/window.h"

struct Reddening {
  float from, full, max_red;  // values of a cell where red begins and is full; the most red
};

// Draws the cells of a map over an image, the redder the larger, interpolated between the cells.
void draw_red_cells(const std::vector<float>& values, int columns, const Reddening& reddening, const Rect& image);

// Draws the unexplained fraction of all frames, the latest at the right; events as red lines.
void draw_health_curve(const std::deque<maquette::HealthMoment>& moments, const Rect& rect, float scale);

// Writes the camera's state and the last events to the panel.
void draw_health_text(const maquette::PredictionFrame& frame, float scale);

nlohmann::ordered_json health_report(const maquette::PredictionFrame& frame);
