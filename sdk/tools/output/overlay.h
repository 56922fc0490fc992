// The image of a dense pose result: parts in colour, iso-contours of U and V, outlines, boxes with scores.
#pragma once

#include <maquette/maquette.hpp>
#include <opencv2/core.hpp>

// Draws over `image` (BGR, the size of the result's planes). Small images are enlarged by a whole number, so that
// the contours can be read.
cv::Mat draw_overlay(const cv::Mat& image, const maquette::DensePoseResult& result);

// Draws the parts alone, in their colours for image generators and on the ground that these expect (BGR).
cv::Mat draw_parts(const maquette::DensePoseResult& result, maq_densepose_colours colours);
