// How surprising a source is, drawn: where, over its picture; when, as a curve; and the events as text.
#pragma once

#include <app/prediction/live_prediction.h>
#include <deque>
#include <nlohmann/json.hpp>

#include "screen/window.h"

// The cells of the latest frame over its picture: the more bits, the redder.
void draw_surprising_cells(const maquette::PredictionFrame& frame, const Rect& picture);

// Bits of the frames so far, logarithmic, the latest at the right; events as red lines.
void draw_surprise_curve(const std::deque<maquette::SurpriseMoment>& moments, const Rect& rect, float scale);

// In the panel: the latest frame's bits and the last events.
void draw_surprise_text(const maquette::PredictionFrame& frame, float scale);

nlohmann::ordered_json surprise_report(const maquette::PredictionFrame& frame);
