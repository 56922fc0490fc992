// A clip of 20 frames, 160 x 120 pixels: a textured square that moves by 4 pixels a frame over a still texture.
#pragma once

#include <cmath>
#include <opencv2/videoio.hpp>
#include <string>

inline void write_square_clip(const std::string& path) {
  cv::VideoWriter clip(path, cv::VideoWriter::fourcc('M', 'J', 'P', 'G'), 20, {160, 120});
  for (int i = 0; i < 20; ++i) {
    cv::Mat image(120, 160, CV_8UC3);
    for (int y = 0; y < image.rows; ++y) {
      for (int x = 0; x < image.cols; ++x) {
        const double u = x - 10 - 4 * i, v = y - 30;
        const bool is_square = u >= 0 && u < 48 && v >= 0 && v < 48;
        const double value = is_square ? 170 + 60 * std::sin(0.5 * u) * std::sin(0.4 * v)
                                       : 90 + 40 * std::sin(0.3 * x) * std::sin(0.2 * y);
        image.at<cv::Vec3b>(y, x) = cv::Vec3b::all(uint8_t(value));
      }
    }
    clip.write(image);
  }
}
