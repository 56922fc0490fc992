// Writes drawn images as a clip, of a kind that this build supports.
#pragma once

#include <filesystem>
#include <maquette/maquette.hpp>
#include <opencv2/core.hpp>
#include <optional>

class ClipFile {
 public:
  // `path` has no extension: that is .mp4 or, where this build cannot write that, .avi (Motion JPEG). Its folder is
  // made when it is not there. An `fps` of 0 or less is not known.
  ClipFile(const maquette::Context& context, std::filesystem::path path, double fps);

  // BGR, all of the size of the first, and of 2 x 2 pixels at least.
  void add(const cv::Mat& picture);
  // Completes the file and returns its path; "" when nothing was added.
  std::filesystem::path finish();

 private:
  void begin(const maquette::Frame& first, const char* extension);

  const maquette::Context& context_;
  std::filesystem::path stem_, path_;
  double fps_;
  std::optional<maquette::Clip> clip_;
};
