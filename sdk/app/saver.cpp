#include "app/saver.h"

#include <ctime>
#include <filesystem>

namespace maquette {
namespace {

namespace fs = std::filesystem;
constexpr std::chrono::seconds kMessageTime(5);

}  // namespace

std::string Saver::new_path(const char* extension) {
  const std::time_t now = std::time(nullptr);
  char name[40];
  std::strftime(name, sizeof name, "maquette-%Y-%m-%d-%H-%M-%S", std::localtime(&now));
  return (fs::path(folder_) / name).string() + "-" + std::to_string(++file_count_) + extension;
}

void Saver::save_snapshot(RgbaImage image, Companions companions) {
  const auto kept = std::make_shared<RgbaImage>(std::move(image));
  run([this, path = new_path(""), kept, companions = std::move(companions)] {
    kept->as_frame(context_).save(path + ".png");
    if (companions == nullptr) return "Saved " + path + ".png";
    return "Saved " + path + ".png, " + companions(path);
  });
}

void Saver::begin_clip(double fps) {
  end_clip();
  clip_ = std::make_shared<OpenClip>();
  clip_->path = new_path(".mp4");
  run([this, clip = clip_, fps] {
    clip->file.emplace(context_, clip->path, fps);
    return "Recording " + clip->path;
  });
}

void Saver::end_clip() {
  if (clip_ == nullptr) return;
  run([clip = std::exchange(clip_, nullptr)] {
    if (!clip->file) return std::string();  // it could not be made, and the message says why
    clip->file->finish();
    return "Saved " + clip->path;
  });
}

void Saver::add_to_clip(RgbaImage image) {
  if (!has_clip()) return;
  if (clip_->width_px == 0) clip_->width_px = image.width_px, clip_->height_px = image.height_px;
  if (clip_->width_px != image.width_px || clip_->height_px != image.height_px) return end_clip();
  run([this, clip = clip_, kept = std::make_shared<RgbaImage>(std::move(image))] {
    if (clip->file) clip->file->add(kept->as_frame(context_));
    return std::string();
  });
}

std::string Saver::message() {
  const auto now = std::chrono::steady_clock::now();
  const std::string latest = files_.message();
  if (latest != message_) message_ = latest, message_since_ = now;
  return now - message_since_ < kMessageTime ? message_ : "";
}

}  // namespace maquette
