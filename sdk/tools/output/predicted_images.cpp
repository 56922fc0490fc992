#include "output/predicted_images.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

#include "output/frame_image.h"
#include "output/output_file.h"

namespace {

constexpr double kMaxMpeg4Side_px = 8190;  // sizes have 13 bits (ISO/IEC 14496-2, 6.2.3), and clips even ones
constexpr double kMaxArea_px = 64e6;       // of a frame of the SDK

}  // namespace

PredictedImages::PredictedImages(const maquette::Context& context, const std::string& out, const std::string& stem,
                                 double fps)
    : context_(context), out_(out), stem_(stem) {
  if (out.empty()) return;
  const std::string extension = out_.extension().string();
  if (extension == ".mp4" || extension == ".avi") {
    make_folder_of(out_);
    clip_.emplace(context, out, fps > 0 ? fps : 10);
  } else if (!extension.empty() && !std::filesystem::is_directory(out_)) {
    throw std::runtime_error(out + " ends in " + extension +
                             "; give a clip (.mp4 or .avi), or a folder for PNG files.");
  }
}

cv::Size PredictedImages::size_in_row(cv::Size size, size_t columns) const {
  const double max_side = clip_ && out_.extension() == ".mp4" ? kMaxMpeg4Side_px : MAQ_MAX_SIDE_PX;
  const double width = double(size.width) * double(columns), height = size.height;
  const double scale = std::min({1.0, max_side / width, max_side / height, std::sqrt(kMaxArea_px / (width * height))});
  if (scale == 1) return size;
  return {std::max(1, int(scale * size.width)), std::max(2, int(scale * size.height))};
}

void PredictedImages::add_to_clip(const cv::Mat& image) {
  cv::Mat fitting = image;
  const cv::Size size = size_in_row(image.size(), 1);
  if (size != image.size()) cv::resize(image, fitting, size, 0, 0, cv::INTER_AREA);
  clip_->add(frame_of(context_, fitting));
  ++count_;
}

void PredictedImages::save(int64_t number, const maquette::Frame& frame, const cv::Mat* compared, int sample) {
  char name[64];
  const int length = std::snprintf(name, sizeof name, "_ahead_%03lld", (long long)number);
  std::snprintf(name + length, sizeof name - size_t(length), sample < 0 ? ".png" : "_sample_%02d.png", sample + 1);
  const std::filesystem::path path = out_ / (stem_ + name);
  make_folder_of(path);
  if (compared != nullptr) {
    frame_of(context_, *compared).save(path.string());
  } else {
    frame.save(path.string());
  }
  ++count_;
}

std::string PredictedImages::finish() {
  if (clip_) clip_->finish();
  return count_ > 0 ? out_.string() : "";
}
