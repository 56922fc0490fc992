#include "people_view.h"

#include <GLFW/glfw3.h>
#include <imgui.h>
#include <algorithm>
#include <iterator>
#include <thread>
#include <utility>

namespace {

constexpr OwnSources kSources = {kFirstCamera, kFirstCamera, "stub:people?count=2",
                                 "These people are rendered; drop a photo, a clip or a recording here."};
constexpr const char* kStages[] = {"trunk",  "proposals", "box head", "dense head", "crops",
                                   "decode", "resize",    "copy",     "wait"};

}  // namespace

PeopleView::PeopleView(const maquette::Context& context, const Options& options, const Window& window, Painter& painter)
    : LiveView(options, window, painter, kSources),
      model_(options.model),
      view_(options.view),
      shows_mesh_(options.mesh),
      wears_colours_(options.person_colours),
      texture_(context),
      live_(
          context, options.model,
          [this](maquette::PipelineResult mapped, double rate) {
            texture_.set_source(live_.status().uri);
            frames_.back().copy_from(std::move(mapped), rate, &seen_, wears_colours_ ? &texture_ : nullptr);
            frames_.publish();
            Window::wake();
          },
          Window::wake, options.live) {
  set_live(&live_);
  // Software OpenGL compiles a shader when it draws with it first: now, before the user waits.
  for (const View view : {View::kCamera, View::kParts}) painter_.draw_people(view, {0, 0, 8, 8});
  painter_.draw_body({0, 0, 8, 8}, 0, 0);
}

bool PeopleView::update() {
  const std::optional<maquette::DensePoseMesh> body = has_surface_ ? std::nullopt : live_.body();
  if (body) painter_.set_body(*body);
  has_surface_ |= body.has_value();
  note_end();
  if (!frames_.take()) return false;
  painter_.set_frame(frame());
  const maq_densepose_stats& s = frame().stats;
  stages_.add({s.trunk_ms, s.proposals_ms, s.box_head_ms, s.dense_head_ms, s.crops_ms, s.decode_ms + s.keypoints_ms,
               s.preprocess_ms, float(frame().copying_ms), float(frame().waiting_ms)});
  return true;
}

Action PeopleView::press(int key) {
  if (key == GLFW_KEY_G) return Action::kHead;
  if (key == GLFW_KEY_A) return Action::kAddToHead;
  if (key >= GLFW_KEY_1 && key <= GLFW_KEY_6) view_ = View(key - GLFW_KEY_1);
  if (key == GLFW_KEY_M) shows_mesh_ = !shows_mesh_;
  if (key == GLFW_KEY_C) wears_colours_ = !wears_colours_;
  return LiveView::press(key);
}

void PeopleView::steer(const Steering& steering, const Rect&) {
  yaw_ -= steering.right;
  pitch_ = std::clamp(pitch_ + steering.down, -1.5f, 1.5f);
}

void PeopleView::draw(const Rect& area) {
  mesh_rect_ = {};
  if (frame().number == 0) return;
  image_rect_ = area.fit(frame().camera.width_px, frame().camera.height_px);
  painter_.draw_people(view_, image_rect_);
  draw_marks();
  if (!shows_mesh_) return;
  const int side = std::min(area.width, area.height) * 3 / 10;
  mesh_rect_ = {0, area.height - side, side, side};
  painter_.draw_body(mesh_rect_, yaw_, pitch_);
}

void PeopleView::draw_marks() const {
  ImDrawList* const list = ImGui::GetBackgroundDrawList();
  const float scale = float(image_rect_.width) / float(frame().camera.width_px);
  const auto on_screen = [&](float x, float y) {
    return ImVec2(float(image_rect_.x) + x * scale, float(image_rect_.y) + y * scale);
  };
  for (const auto& [x0, y0, x1, y1] : frame().skeletons) {
    list->AddLine(on_screen(x0, y0), on_screen(x1, y1), IM_COL32_WHITE, 3 * window_.scale());
  }
  if (view_ != View::kBoxes) return;
  for (const maq_densepose_person& person : frame().people) {
    const ImVec2 from = on_screen(person.box_px[0], person.box_px[1]);
    const ImVec2 to = on_screen(person.box_px[2], person.box_px[3]);
    list->AddRect(from, to, IM_COL32(255, 255, 255, 255), 0, 0, 2 * window_.scale());
    const std::string label = maquette::label_of(person);
    const ImVec2 size = ImGui::CalcTextSize(label.c_str());
    const float top = std::max(float(image_rect_.y), from.y - size.y - 4);
    list->AddRectFilled({from.x, top}, {from.x + size.x + 8, top + size.y + 4}, IM_COL32(255, 255, 255, 255));
    list->AddText({from.x + 4, top + 2}, IM_COL32(24, 26, 40, 255), label.c_str());
  }
}

maquette::Saver::Companions PeopleView::companions() const {
  if (frame().result == nullptr) return nullptr;
  return [result = frame().result](const std::string& path) {
    result->save(path);
    return "_IUV.png, _INDS.png and .json";
  };
}

void PeopleView::add_to_report(nlohmann::ordered_json* report) const {
  LiveView::add_to_report(report);
  nlohmann::ordered_json& json = *report;
  json["frames"] = frame().number;
  json["view"] = kViewNames[size_t(view_)];
  json["mesh_px"] = nullptr;
  if (mesh_rect_.width > 0) json["mesh_px"] = window_.in_pixels(mesh_rect_).numbers();
  json["frame_px"] = {frame().camera.width_px, frame().camera.height_px};
  json["people"] = nlohmann::json::array();
  for (const maq_densepose_person& person : frame().people) {
    json["people"].push_back({{"box", person.box_px}, {"score", person.score}});
  }
  json["scene"] = nullptr;
}

Action PeopleView::draw_panel() {
  Action action = draw_source(frame().results_per_second);
  const maq_densepose_stats& stats = frame().stats;
  ImGui::Text("%.1f ms a frame, %d %s%s", double(stats.total_ms), stats.person_count,
              stats.person_count == 1 ? "person" : "people", stats.is_key_frame != 0 ? "" : ", tracked");
  if (frame().age_ms >= 0) ImGui::Text("from camera to result: %.0f ms", frame().age_ms);
  stages_.draw(kStages, std::size(kStages), window_.scale());
  draw_views();
  ImGui::Separator();
  ImGui::TextWrapped("%s, %d x %d", options_.bundle.substr(options_.bundle.rfind('/') + 1).c_str(),
                     stats.network_width_px, stats.network_height_px);
  draw_model_options();
  if (ImGui::Button("Edges of a depth camera (F5)")) action = Action::kOtherView;
  if (ImGui::Button("Prediction (F7)")) action = Action::kPrediction;
  if (ImGui::Button("Head of this person (G)")) action = Action::kHead;
  ImGui::SameLine();
  if (ImGui::Button("add (A)")) action = Action::kAddToHead;
  return action;
}

void PeopleView::draw_views() {
  ImGui::TextUnformatted("Views (1 to 6)");
  for (size_t view = 0; view < kViewNames.size(); ++view) {
    if (view % 3 != 0) ImGui::SameLine(float(view % 3) * 100 * window_.scale());
    if (ImGui::RadioButton(kViewNames[view], view_ == View(view))) view_ = View(view);
  }
  ImGui::Checkbox("body surface (M)", &shows_mesh_);
  bool wears_colours = wears_colours_;
  if (shows_mesh_ && ImGui::Checkbox("in the person's colours (C)", &wears_colours)) wears_colours_ = wears_colours;
  draw_pause();
  if (view_ == View::kTryOn) ImGui::TextWrapped("Drop a picture to wear it.");
}

void PeopleView::draw_model_options() {
  const int cores = int(std::max(1u, std::thread::hardware_concurrency()));
  bool changed = false;
  // Loading takes a moment, so a slider counts when it is released.
  const auto slider = [&](const char* name, int* value, int min, int max, const char* format) {
    ImGui::SliderInt(name, value, min, max, format, ImGuiSliderFlags_AlwaysClamp);
    changed |= ImGui::IsItemDeactivatedAfterEdit();
  };
  slider("threads", &model_.model.threads, 0, cores, model_.model.threads == 0 ? "large cores" : "%d");
  slider("key frames", &model_.key_frame_interval, 0, 30, model_.key_frame_interval <= 1 ? "every" : "one in %d");
  slider("long side", &model_.long_side_px, 0, 1024, model_.long_side_px == 0 ? "automatic" : "%d px");
  if (model_.long_side_px > 0) model_.long_side_px = std::max(64, model_.long_side_px);
  changed |= ImGui::CheckboxFlags("skeletons", &model_.has_keypoints, 1);
  bool parts_alone = model_.detail == MAQ_DENSEPOSE_DETAIL_PART;
  if (ImGui::Checkbox("parts alone, no U and V", &parts_alone)) {
    model_.detail = parts_alone ? MAQ_DENSEPOSE_DETAIL_PART : MAQ_DENSEPOSE_DETAIL_SURFACE;
    changed = true;
  }
  int crops = int(model_.person_crops);  // the default of streams is off
  if (ImGui::Combo("crops of people", &crops, "off\0small or leaning\0all\0")) {
    model_.person_crops = maq_densepose_crops(crops);
    changed = true;
  }
  if (changed) live_.set_model(model_);
  if (ImGui::SliderAngle("camera's roll", &roll_rad_, -180, 180)) live_.set_roll(roll_rad_);
}
