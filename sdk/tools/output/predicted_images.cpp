#include "output/predicted_images.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <stdexcept>

#include "output/frame_image.h"
#include "output/output_file.h"

namespace {

constexpr double kMaxArea_px = 64e6;  // of a frame of the SDK

}  // namespace

PredictedImages::PredictedImages(const maquette::Context& context, const std::string& out, const std::string& stem,
                                 double fps)
    : context_(context), out_(std::filesystem::u8path(out)), stem_(stem) {
  if (out.empty()) return;
  const std::string extension = out_.extension().string();
  if (extension == ".mp4") {
    make_folder_of(out_);
    clip_.emplace(context, out, fps > 0 ? fps : 10);
  } else if (!extension.empty() && !std::filesystem::is_directory(out_)) {
    throw std::runtime_error(out + " ends in " + extension + "; give a clip (.mp4), or a folder for PNG files.");
  }
}

PictureSide PredictedImages::size_in_row(PictureSide size, size_t columns) {
  const double width = double(size.width) * double(columns), height = size.height;
  const double scale = std::min({1.0, MAQ_MAX_SIDE_PX / width, std::sqrt(kMaxArea_px / (width * height))});
  if (scale == 1) return size;
  return {std::max(1, int(scale * size.width)), std::max(2, int(scale * size.height))};
}

void PredictedImages::add_to_clip(const Canvas& image) {
  clip_->add(frame_of(context_, image));
  ++count_;
}

void PredictedImages::save(int64_t number, const maquette::Frame& frame, const Canvas* compared, int sample) {
  char name[64];
  const int length = std::snprintf(name, sizeof name, "_ahead_%03lld", (long long)number);
  std::snprintf(name + length, sizeof name - size_t(length), sample < 0 ? ".png" : "_sample_%02d.png", sample + 1);
  const std::filesystem::path path = out_ / std::filesystem::u8path(stem_ + name);
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
