// Marks predicted frames in images, so that nobody takes them for captured ones.
#pragma once

#include <maquette/maquette.hpp>
#include <string>

#include "output/canvas.h"

// Draws a border and, if there is room, the time ahead; nothing for a captured frame.
void draw_prediction_mark(const maquette::Frame& frame, Canvas& image);

// Draws a line of text at the top, white on black.
void draw_caption(const std::string& text, Canvas& image);
