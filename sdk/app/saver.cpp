#include "saver.h"

#include <ctime>
#include <filesystem>
#include <utility>

namespace fs = std::filesystem;

namespace {
constexpr double kMessageS = 5;
}

std::string Saver::new_path(const char* extension) {
  const std::time_t now = std::time(nullptr);
  char name[40];
  std::strftime(name, sizeof name, "maquette-%Y-%m-%d-%H-%M-%S", std::localtime(&now));
  return (fs::path(folder_) / name).string() + "-" + std::to_string(++file_count_) + extension;
}

void Saver::save_snapshot(maquette::RgbaImage image, std::shared_ptr<const maquette::DensePoseResult> people) {
  const auto kept = std::make_shared<maquette::RgbaImage>(std::move(image));
  files_.add([this, path = new_path(""), kept, people = std::move(people)] {
    kept->as_frame(context_).save(path + ".png");
    if (people != nullptr) people->save(folder_, fs::path(path).filename().string());
    return "Saved " + path + ".png" + (people != nullptr ? ", _IUV.png, _INDS.png and .json" : "");
  });
}

void Saver::begin_clip(const Rect& rect, double fps) {
  clip_path_ = new_path(".mp4");
  clip_rect_ = rect;
  clip_ = std::make_shared<std::optional<maquette::Clip>>();
  files_.add([this, clip = clip_, path = clip_path_, fps] {
    clip->emplace(context_, path, fps);
    return "Recording " + path;
  });
}

void Saver::end_clip() {
  if (clip_ == nullptr) return;
  files_.add([clip = std::exchange(clip_, nullptr), path = clip_path_] {
    if (*clip) (*clip)->finish();
    return "Saved " + path;
  });
}

void Saver::add_to_clip(const Window& window, const Rect& rect) {
  if (clip_rect_.width != rect.width || clip_rect_.height != rect.height) return end_clip();
  if (files_.is_busy()) return;
  const auto image = std::make_shared<maquette::RgbaImage>(window.read_pixels(rect));
  files_.add([this, clip = clip_, image] {
    if (*clip) (*clip)->add(image->as_frame(context_));
    return std::string();
  });
}

std::string Saver::toggle_recording() {
  const std::string ended = std::exchange(recording_, recording_.empty() ? new_path(".maqrec") : "");
  files_.add([text = ended.empty() ? "Recording " + recording_ : "Saved " + ended] { return text; });
  return recording_;
}

std::string Saver::message() {
  const std::string latest = files_.message();
  if (latest != message_) message_ = latest, message_since_s_ = monotonic_s();
  return monotonic_s() - message_since_s_ < kMessageS ? message_ : "";
}
