// The mark of predicted frames in pictures that are drawn: nobody must take them for a camera's.
#pragma once

#include <maquette/maquette.hpp>
#include <opencv2/core.hpp>

// A border and, where there is room, how far ahead it was predicted; nothing for a frame that was captured. BGR.
void draw_prediction_mark(const maquette::Frame& frame, cv::Mat& picture);

// A line of text at the top, white on black.
void draw_caption(const std::string& text, cv::Mat& picture);
