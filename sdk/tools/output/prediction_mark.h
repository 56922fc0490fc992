// The mark of predicted frames in drawn pictures, so that they are not mistaken for captured ones.
#pragma once

#include <maquette/maquette.hpp>
#include <opencv2/core.hpp>

// A border and, where there is room, how far ahead it was predicted; nothing for a frame that was captured. BGR.
void draw_prediction_mark(const maquette::Frame& frame, cv::Mat& picture);

// A line of text at the top, white on black.
void draw_caption(const std::string& text, cv::Mat& picture);
