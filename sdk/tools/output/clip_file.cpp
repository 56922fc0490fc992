#include "output/clip_file.h"

#include <algorithm>

#include "output/frame_image.h"
#include "output/output_file.h"

namespace {

// Limits of a clip in the SDK.
constexpr double kMinFps = 0.01;
constexpr double kMaxFps = 1000;

}  // namespace

ClipFile::ClipFile(const maquette::Context& context, std::filesystem::path path, double fps)
    : context_(context), path_(std::move(path)), fps_(fps > 0 ? std::clamp(fps, kMinFps, kMaxFps) : 25) {}

void ClipFile::add(const Canvas& image) {
  if (!clip_) {
    make_folder_of(path_);
    clip_.emplace(context_, path_.string(), fps_);
  }
  clip_->add(frame_of(context_, image));
}

std::filesystem::path ClipFile::finish() {
  if (!clip_) return {};
  clip_->finish();
  return path_;
}
