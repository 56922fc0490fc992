#include "clip_file.h"

#include <stdexcept>

namespace fs = std::filesystem;

ClipFile::ClipFile(fs::path path, double fps) : path_(std::move(path)), fps_(fps > 0 ? fps : 25) {}

void ClipFile::open(cv::Size size) {
  struct Format {
    const char* extension;
    int fourcc;
  };
  const Format formats[] = {{".mp4", cv::VideoWriter::fourcc('m', 'p', '4', 'v')},
                            {".avi", cv::VideoWriter::fourcc('M', 'J', 'P', 'G')}};
  for (const Format& format : formats) {
    path_.replace_extension(format.extension);
    file_ = std::make_unique<OutputFile>(path_);
    if (writer_.open(file_->temporary_path().string(), format.fourcc, fps_, size)) return;
  }
  throw std::runtime_error(path_.string() + " cannot be written: this OpenCV writes neither MP4 nor Motion JPEG. " +
                           "Do without the clip, or use an OpenCV with video support.");
}

void ClipFile::add(const cv::Mat& picture) {
  // MPEG-4 wants even sides.
  const cv::Size size(picture.cols / 2 * 2, picture.rows / 2 * 2);
  if (size.area() == 0) return;
  if (!writer_.isOpened()) open(size);
  writer_.write(picture(cv::Rect(cv::Point(), size)));
}

fs::path ClipFile::finish() {
  if (!writer_.isOpened()) return {};
  writer_.release();
  file_->commit();
  return path_;
}
