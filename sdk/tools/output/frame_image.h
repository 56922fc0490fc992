// Between frames of the SDK and images of OpenCV, which the programs draw on.
#pragma once

#include <maquette/maquette.hpp>
#include <opencv2/core.hpp>

// BGR, a copy.
cv::Mat image_of(const maquette::Frame& frame);

// Wraps the image's memory, which must stay until the frame is gone. BGR.
maquette::Frame frame_of(const maquette::Context& context, const cv::Mat& image);
