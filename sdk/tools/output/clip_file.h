// Drawn pictures as a clip, of the kind that this build can write.
#pragma once

#include <filesystem>
#include <maquette/maquette.hpp>
#include <opencv2/core.hpp>
#include <optional>

class ClipFile {
 public:
  // `path` ends in .mp4; where this build cannot write that, the file is .avi (Motion JPEG) instead. Its folder is made
  // when it is not there. An `fps` of 0 or less is not known.
  ClipFile(const maquette::Context& context, std::filesystem::path path, double fps);

  // BGR, all of the size of the first.
  void add(const cv::Mat& picture);
  // Completes the file and returns its path; "" when nothing was added.
  std::filesystem::path finish();

 private:
  void begin(const maquette::Frame& first, const char* extension);

  const maquette::Context& context_;
  std::filesystem::path path_;
  double fps_;
  std::optional<maquette::Clip> clip_;
};
