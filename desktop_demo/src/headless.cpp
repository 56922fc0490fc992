// Runs without a person: when they end, and what they tell.
#include <algorithm>
#include <nlohmann/json.hpp>

#include "app.h"

namespace {

nlohmann::json as_json(const Rect& rect) { return {rect.x, rect.y, rect.width, rect.height}; }

}  // namespace

bool App::has_failed() const {
  return shows_scene_ ? scenes_.state()->what == maquette::LiveSceneState::kFailed : people_.status().failed;
}

bool App::is_done() {
  if (has_failed()) return true;
  if (!shows_scene_) return ended_;
  if (pictures_ == 0 || pictures_ == done_pictures_) return false;
  done_pictures_ = pictures_;
  // It looks around, and ends where a photo was taken.
  if (pictures_ + 1 < options_.frames) {
    flight_->turn(pictures_ % 40 < 20 ? 0.02 : -0.02, 0);
    turned_ = true;
    return false;
  }
  if (scenes_.shown().front().photo_index >= 0 || scenes_.state()->photos.empty()) return true;
  go_to_photo(flight_->nearest_photo(scenes_.state()->photos));
  return false;
}

std::string App::report() const {
  std::vector<float> sorted = turns_ms_;
  std::sort(sorted.begin(), sorted.end());
  const auto rank = [&](size_t percent) { return sorted.empty() ? 0.0f : sorted[(sorted.size() - 1) * percent / 100]; };
  const MappedFrame& frame = mapped_.front();
  const maquette::LiveStatus status = people_.status();
  nlohmann::ordered_json json;
  json["frames"] = shows_scene_ ? pictures_ : frame.number;
  json["source"] = status.uri;
  json["view"] = kViewNames[size_t(options_.view)];
  const Rect all = window_.in_pixels(window_.rect());
  json["window_px"] = {all.width, all.height};
  json["picture_px"] = as_json(window_.in_pixels(picture_rect_));
  json["mesh_px"] = body_rect_.width > 0 ? as_json(window_.in_pixels(body_rect_)) : nlohmann::json();
  json["frame_px"] = {frame.camera.width_px, frame.camera.height_px};
  json["people"] = nlohmann::json::array();
  for (const maq_person& person : frame.people) {
    json["people"].push_back({{"box", person.box_px}, {"score", person.score}});
  }
  json["drops"] = status.drops;
  json["events"] = status.events;
  json["problem"] = status.problem;
  json["ui"] = {{"turns", sorted.size()}, {"longest_ms", rank(100)}, {"p99_ms", rank(99)}, {"start_ms", start_ms_}};
  json["opengl"] = window_.opengl();
  json["scene"] = nullptr;
  if (shows_scene_) {
    const auto state = scenes_.state();
    const maquette::LiveScenePicture& shown = scenes_.shown().front();
    json["problem"] = state->what == maquette::LiveSceneState::kFailed ? state->text : "";
    json["scene"] = {{"points", state->info.point_count}, {"photo", nullptr}, {"psnr_db", nullptr}};
    if (pictures_ > 0 && shown.photo_index >= 0) {
      json["scene"]["photo"] = state->photo_names[size_t(shown.photo_index)];
      json["scene"]["psnr_db"] = shown.psnr_db;
    }
  }
  return json.dump();
}
