// The overlay of a clip, as a video file that appears when it is complete.
#pragma once

#include <filesystem>
#include <memory>
#include <opencv2/videoio.hpp>
#include <string>

#include "output_file.h"

class OverlayClip {
 public:
  // <stem>_overlay.mp4 in `folder`, or .avi (Motion JPEG) where this OpenCV cannot write MP4.
  OverlayClip(std::filesystem::path folder, std::string stem, double fps);

  void add(const cv::Mat& overlay);
  // Completes the file and returns its path; "" when nothing was added.
  std::filesystem::path finish();

 private:
  void open(cv::Size size);

  std::filesystem::path folder_;
  std::string stem_;
  double fps_;
  cv::VideoWriter writer_;
  std::filesystem::path path_;
  std::unique_ptr<OutputFile> file_;
};
