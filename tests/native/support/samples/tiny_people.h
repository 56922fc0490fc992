// Images of what the tiny bundle of dense pose takes for people (make_tiny_bundle.py): colours before black.
#pragma once

#include <opencv2/core.hpp>

inline const cv::Scalar kRed(0, 0, 255), kGreen(0, 255, 0), kBlue(255, 0, 0);

inline cv::Mat black(int width, int height) { return cv::Mat::zeros(height, width, CV_8UC3); }
