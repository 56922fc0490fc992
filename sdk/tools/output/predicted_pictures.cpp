#include "output/predicted_pictures.h"

#include <cstdio>
#include <stdexcept>

#include "output/frame_image.h"
#include "output/output_file.h"

PredictedPictures::PredictedPictures(const maquette::Context& context, const std::string& out, const std::string& stem,
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

void PredictedPictures::add_to_clip(const cv::Mat& picture) {
  clip_->add(frame_of(context_, picture));
  ++count_;
}

void PredictedPictures::save(int64_t number, const maquette::Frame& frame, const cv::Mat* compared, int sample) {
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

std::string PredictedPictures::finish() {
  if (clip_) clip_->finish();
  return count_ > 0 ? out_.string() : "";
}
