#include "overlay_clip.h"

#include <stdexcept>

namespace fs = std::filesystem;

OverlayClip::OverlayClip(fs::path folder, std::string stem, double fps)
    : folder_(std::move(folder)), stem_(std::move(stem)), fps_(fps > 0 ? fps : 25) {}

void OverlayClip::open(cv::Size size) {
  struct Format {
    const char* extension;
    int fourcc;
  };
  const Format formats[] = {{".mp4", cv::VideoWriter::fourcc('m', 'p', '4', 'v')},
                            {".avi", cv::VideoWriter::fourcc('M', 'J', 'P', 'G')}};
  for (const Format& format : formats) {
    path_ = folder_ / (stem_ + "_overlay" + format.extension);
    file_ = std::make_unique<OutputFile>(path_);
    if (writer_.open(file_->temporary_path().string(), format.fourcc, fps_, size)) return;
  }
  throw std::runtime_error(path_.string() + " cannot be written: this OpenCV writes neither MP4 nor Motion JPEG. " +
                           "Leave out --overlay, or use an OpenCV with video support.");
}

void OverlayClip::add(const cv::Mat& overlay) {
  // MPEG-4 wants even sides.
  const cv::Size size(overlay.cols / 2 * 2, overlay.rows / 2 * 2);
  if (size.area() == 0) return;
  if (!writer_.isOpened()) open(size);
  writer_.write(overlay(cv::Rect(cv::Point(), size)));
}

fs::path OverlayClip::finish() {
  if (!writer_.isOpened()) return {};
  writer_.release();
  file_->commit();
  return path_;
}
