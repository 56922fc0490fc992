// The image of a dense pose result: parts in colour, iso-contours of U and V, outlines, boxes with scores.
#pragma once

#include <maquette/maquette.hpp>

#include "output/canvas.h"

// Draws over `image` (the size of the result's planes). Small images are enlarged by a whole number, so that the
// contours can be read. `has_keypoints`: the result has keypoints, which are drawn as skeletons.
Canvas draw_overlay(const Canvas& image, const maquette::DensePoseResult& result, bool has_keypoints = false);

// Draws the parts alone, in their colours for image generators and on the ground that these expect.
Canvas draw_parts(const maquette::DensePoseResult& result, maq_densepose_colours colours);
