#include "output/clip_file.h"

#include <algorithm>

#include "output/frame_image.h"
#include "output/output_file.h"

namespace fs = std::filesystem;

namespace {

// Limits of a clip in the SDK.
constexpr double kMinFps = 0.01;
constexpr double kMaxFps = 1000;

}  // namespace

ClipFile::ClipFile(const maquette::Context& context, fs::path path, double fps)
    : context_(context), stem_(std::move(path)), fps_(fps > 0 ? std::clamp(fps, kMinFps, kMaxFps) : 25) {}

void ClipFile::begin(const maquette::Frame& first, const char* extension) {
  path_ = stem_.string() + extension;
  make_folder_of(path_);
  clip_.emplace(context_, path_.string(), fps_);
  clip_->add(first);
}

void ClipFile::add(const cv::Mat& picture) {
  const maquette::Frame frame = frame_of(context_, picture);
  if (clip_) return clip_->add(frame);
  try {
    begin(frame, ".mp4");
  } catch (const maquette::Error& error) {
    clip_.reset();
    if (error.status() != MAQ_ERROR_UNSUPPORTED) throw;
    begin(frame, ".avi");
  }
}

fs::path ClipFile::finish() {
  if (!clip_) return {};
  clip_->finish();
  return path_;
}
