// What the demo writes: screenshots, snapshots, clips, recordings.
#include <ctime>
#include <filesystem>

#include "app.h"

namespace fs = std::filesystem;

std::string App::new_path(const char* extension) {
  const std::time_t now = std::time(nullptr);
  char name[40];
  std::strftime(name, sizeof name, "maquette-%Y-%m-%d-%H-%M-%S", std::localtime(&now));
  return (fs::path(options_.out) / name).string() + "-" + std::to_string(++files_made_) + extension;
}

void App::take_snapshot() {
  const std::string path = new_path("");
  auto picture = std::make_shared<maquette::Picture>(window_.read_pixels(picture_rect_));
  const auto result = shows_scene_ ? nullptr : mapped_.front().result;
  files_.add([this, path, picture, result] {
    picture->frame(context_).save(path + ".png");
    if (result != nullptr) result->save(options_.out, fs::path(path).filename().string());
    return "Saved " + path + ".png" + (result != nullptr ? ", _IUV.png, _INDS.png and .json" : "");
  });
}

void App::toggle_clip() {
  if (clip_file_ != nullptr) {
    files_.add([file = std::move(clip_file_), path = clip_path_] {
      if (*file) (*file)->finish();
      return "Saved " + path;
    });
    clip_file_ = nullptr;
    return;
  }
  clip_path_ = new_path(".mp4");
  clip_rect_ = picture_rect_;
  const double fps = shows_scene_ ? 25 : std::max(1.0, mapped_.front().fps);
  clip_file_ = std::make_shared<std::optional<maquette::Clip>>();
  files_.add([this, file = clip_file_, path = clip_path_, fps] {
    file->emplace(context_, path, fps);
    return "Recording " + path;
  });
}

// A clip has one size: it ends where the window gets another.
void App::add_to_clip() {
  if (clip_rect_.width != picture_rect_.width || clip_rect_.height != picture_rect_.height) return toggle_clip();
  if (files_.is_busy()) return;
  auto picture = std::make_shared<maquette::Picture>(window_.read_pixels(picture_rect_));
  files_.add([this, file = clip_file_, picture] {
    if (*file) (*file)->add(picture->frame(context_));
    return std::string();
  });
}

void App::toggle_recording() {
  const std::string told = recording_.empty() ? "" : "Saved " + recording_;
  recording_ = recording_.empty() ? new_path(".maqrec") : "";
  people_.record(recording_);
  files_.add([told = told.empty() ? "Recording " + recording_ : told] { return told; });
}
