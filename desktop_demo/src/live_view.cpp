#include "live_view.h"

#include <GLFW/glfw3.h>
#include <imgui.h>
#include <utility>

namespace {

constexpr const char* kStateNames[] = {"stopped", "opening",      "loading", "running", "paused",
                                       "stalled", "reconnecting", "ended",   "failed"};

}  // namespace

void LiveView::open(const std::string& uri) {
  stages_.clear();
  seeks_camera_ = uri == own_.camera;
  recording_.clear();  // it ends with its source
  live_->open(maquette::source_uri(uri), seeks_camera_ ? own_.stand_in : "");
}

std::string LiveView::hand_over() {
  const std::string uri = seeks_camera_ ? own_.camera : live_->status().uri;
  recording_.clear();
  live_->close();
  return uri;
}

void LiveView::set_visible(bool is_visible) {
  is_visible_ = is_visible;
  stages_.clear();
  apply_pause();
}

void LiveView::toggle_recording(maquette::Saver& saver) {
  const std::string ended = std::exchange(recording_, recording_.empty() ? saver.new_path(".maqrec") : "");
  live_->set_recording(recording_);
  saver.run([text = ended.empty() ? "Recording " + recording_ : "Saved " + ended] { return text; });
}

Action LiveView::press(int key) {
  if (key == GLFW_KEY_P) {
    is_paused_ = !is_paused_;
    apply_pause();
  }
  return Action::kNone;
}

std::string LiveView::failure() const {
  const maquette::LiveStatus status = live_->status();
  return status.has_failed ? status.problem : "";
}

std::string LiveView::message() const {
  const maquette::LiveStatus status = live_->status();
  const std::string text = status.problem.empty() ? status.activity : status.problem;
  const bool shows_stand_in = seeks_camera_ && status.uri == own_.stand_in && !text.empty();
  return text + (shows_stand_in ? std::string(" ") + own_.stand_in_text : "");
}

void LiveView::add_to_report(nlohmann::ordered_json* report) const {
  const maquette::LiveStatus status = live_->status();
  nlohmann::ordered_json& json = *report;
  json["source"] = status.uri;
  json["picture_px"] = window_.in_pixels(image_rect_).numbers();
  json["dropped_frames"] = status.dropped_frames;
  json["states"] = nlohmann::json::array();
  for (const maq_pipeline_state state : status.states) json["states"].push_back(kStateNames[state]);
  json["problem"] = status.problem;
}

Action LiveView::draw_source(double results_per_second) const {
  Action action = Action::kNone;
  const maquette::LiveStatus status = live_->status();
  ImGui::TextWrapped("%s", status.uri.c_str());
  if (ImGui::SmallButton(recording_.empty() ? "Record the source (F4)" : "End recording (F4)"))
    action = Action::kRecord;
  ImGui::SameLine();
  if (ImGui::SmallButton("Look for a camera")) action = Action::kOpenCamera;
  ImGui::Text("%.1f frames a second, %llu dropped", results_per_second,
              static_cast<unsigned long long>(status.dropped_frames));
  return action;
}

void LiveView::draw_pause() {
  if (ImGui::Checkbox("pause (P)", &is_paused_)) apply_pause();
}
