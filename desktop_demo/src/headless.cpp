#include "headless.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "people_view.h"
#include "scene_view.h"

namespace {

constexpr size_t kMaxFrames = 1000000;
constexpr const char* kStateNames[] = {"stopped", "opening",      "loading", "running", "paused",
                                       "stalled", "reconnecting", "ended",   "failed"};

nlohmann::json as_json(const Rect& rect) { return {rect.x, rect.y, rect.width, rect.height}; }

}  // namespace

void HeadlessRun::add_frame(double begin_s) {
  const double now_s = monotonic_s();
  if (start_ms_ == 0) {
    start_ms_ = (now_s - start_s_) * 1000;
  } else if (frame_ms_.size() < kMaxFrames) {
    frame_ms_.push_back(float((now_s - begin_s) * 1000));
  }
}

std::string HeadlessRun::failure(const PeopleView& people) const {
  const maquette::LiveDensePoseStatus status = people.status();
  return status.has_failed ? status.problem : "";
}

std::string HeadlessRun::failure(const SceneView& scene) const {
  return scene.state()->phase == maquette::LiveSceneState::kFailed ? scene.state()->text : "";
}

bool HeadlessRun::is_done(const PeopleView& people) const { return people.has_ended(); }

bool HeadlessRun::is_done(SceneView& scene) {
  if (!failure(scene).empty()) return true;
  const uint64_t images = scene.image_count();
  if (images == 0 || images == done_images_) return false;
  done_images_ = images;
  if (images + 1 < frames_) {
    scene.rotate(images % 40 < 20 ? 0.02 : -0.02);
    return false;
  }
  if (scene.image().photo_index >= 0 || scene.state()->photos.empty()) return true;
  scene.fly_to_nearest_photo();
  return false;
}

std::string HeadlessRun::report(const PeopleView& people, const SceneView* scene, const Window& window) const {
  std::vector<float> sorted = frame_ms_;
  std::sort(sorted.begin(), sorted.end());
  const auto rank = [&](size_t percent) { return sorted.empty() ? 0.0f : sorted[(sorted.size() - 1) * percent / 100]; };
  const MappedFrame& frame = people.frame();
  const maquette::LiveDensePoseStatus status = people.status();
  nlohmann::ordered_json json;
  json["frames"] = scene != nullptr ? scene->image_count() : frame.number;
  json["source"] = status.uri;
  json["view"] = kViewNames[size_t(people.view())];
  const Rect all = window.in_pixels(window.rect()), mesh = people.mesh_rect();
  json["window_px"] = {all.width, all.height};
  json["picture_px"] = as_json(window.in_pixels(scene != nullptr ? scene->image_rect() : people.image_rect()));
  json["mesh_px"] = mesh.width > 0 ? as_json(window.in_pixels(mesh)) : nlohmann::json();
  json["frame_px"] = {frame.camera.width_px, frame.camera.height_px};
  json["people"] = nlohmann::json::array();
  for (const maq_person& person : frame.people) {
    json["people"].push_back({{"box", person.box_px}, {"score", person.score}});
  }
  json["dropped_frames"] = status.dropped_frames;
  json["states"] = nlohmann::json::array();
  for (const maq_pipeline_state state : status.states) json["states"].push_back(kStateNames[state]);
  json["problem"] = scene != nullptr ? failure(*scene) : status.problem;
  json["ui"] = {{"frames", sorted.size()}, {"longest_ms", rank(100)}, {"p99_ms", rank(99)}, {"start_ms", start_ms_}};
  json["opengl"] = window.opengl();
  json["scene"] = nullptr;
  if (scene != nullptr) {
    json["scene"] = {{"points", scene->state()->info.point_count}, {"photo", nullptr}, {"psnr_db", nullptr}};
    const int photo = scene->image().photo_index;
    if (scene->image_count() > 0 && photo >= 0) {
      json["scene"]["photo"] = scene->state()->photo_names[size_t(photo)];
      json["scene"]["psnr_db"] = scene->image().psnr_db;
    }
  }
  return json.dump();
}
