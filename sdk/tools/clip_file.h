// Pictures as a video file that appears when it is complete.
#pragma once

#include <filesystem>
#include <memory>
#include <opencv2/videoio.hpp>

#include "output_file.h"

class ClipFile {
 public:
  // `path` ends in .mp4; where this OpenCV cannot write that, the file is .avi (Motion JPEG) instead.
  ClipFile(std::filesystem::path path, double fps);

  // BGR, all of the size of the first.
  void add(const cv::Mat& picture);
  // Completes the file and returns its path; "" when nothing was added.
  std::filesystem::path finish();

 private:
  void open(cv::Size size);

  std::filesystem::path path_;
  double fps_;
  cv::VideoWriter writer_;
  std::unique_ptr<OutputFile> file_;
};
