#include "next_view.h"

#include <GLFW/glfw3.h>
#include <app/tiling.h>
#include <imgui.h>
#include <cmath>
#include <iterator>

#include "drawing/surprise_drawing.h"

namespace {

constexpr OwnSources kPredictedSources = {kFirstCamera, kFirstCamera, "stub:people?count=2",
                                          "These people are rendered; drop a clip or a recording here."};
constexpr const char* kPredictionStages[] = {"brightness", "motion", "choice", "move on", "pixels", "wait", "network"};
constexpr float kCurveHeight = 90;
constexpr double kAheadSPerRadian = 0.3;  // of what drags and arrows turn elsewhere
constexpr Reddening kSurpriseRed = {1, 8, 0.7f}, kUncertainRed = {1, 6, 0.6f};
constexpr ImU32 kMadeUpColour = IM_COL32(255, 0, 255, 255), kDarkColour = IM_COL32(20, 20, 24, 220);

}  // namespace

NextView::NextView(const maquette::Context& context, const Options& options, const Window& window, Painter& painter)
    : LiveView(options, window, painter, kPredictedSources),
      choice_(options.prediction),
      live_(
          context, options.prediction,
          [this](const maquette::PredictionFrame& frame) {
            frames_.back() = frame;
            frames_.publish();
            Window::wake();
          },
          Window::wake, options.live) {
  set_live(&live_);
}

// Meanwhile others drew into the textures.
void NextView::set_visible(bool is_visible) {
  LiveView::set_visible(is_visible);
  if (is_visible && frame().number > 0) painter_.set_scene(frame().next, frame().now, frame().drawn.picture);
}

bool NextView::update() {
  note_end();
  if (!frames_.take()) return false;
  painter_.set_scene(frame().next, frame().now, frame().drawn.picture);
  const maq_predictor_stats& s = frame().stats;
  stages_.add({s.grey_ms, s.flow_ms, s.choice_ms, s.project_ms, s.fetch_ms, float(frame().waiting_ms), s.networks_ms});
  return true;
}

Action NextView::press(int key) {
  if (key >= GLFW_KEY_1 && key <= GLFW_KEY_4) choice_.method = maq_prediction_method(key - GLFW_KEY_1);
  if (key == GLFW_KEY_B) choice_.bridges_gaps = !choice_.bridges_gaps;
  if (key == GLFW_KEY_S) choice_.finds_surprise = !choice_.finds_surprise;
  if (key == GLFW_KEY_U) choice_.finds_uncertainty = !choice_.finds_uncertainty;
  if (key == GLFW_KEY_D) choice_.draws_sample = !choice_.draws_sample;
  live_.set_choice(choice_);
  return LiveView::press(key);
}

void NextView::steer(const Steering& steering, const Rect&) {
  if (steering.right == 0) return;
  choice_.ahead_s =
      std::clamp(choice_.ahead_s + kAheadSPerRadian * double(steering.right), kMinAheadMs / 1e3, kMaxAheadMs / 1e3);
  live_.set_choice(choice_);
}

// In as many columns as make them largest; the curve of surprise below all.
void NextView::place(Rect area) {
  const int curve_height = choice_.finds_surprise ? std::min(int(kCurveHeight * window_.scale()), area.height / 4) : 0;
  area.height -= curve_height;
  const maquette::Tiling one = maquette::tile(choice_.draws_sample ? 3 : 2, area.width, area.height,
                                              frame().now.width_px, frame().now.height_px);
  const int all_width = one.columns * one.width, all_height = one.rows * one.height;
  image_rect_ = {area.x + (area.width - all_width) / 2, area.y + (area.height - all_height) / 2, all_width, all_height};
  Rect* const rects[] = {&now_rect_, &next_rect_, &sample_rect_};
  for (int i = 0; i < 3; ++i) {
    *rects[i] = {image_rect_.x + i % one.columns * one.width, image_rect_.y + i / one.columns * one.height, one.width,
                 one.height};
  }
  curve_rect_ = {image_rect_.x, image_rect_.y + all_height, all_width, curve_height};
  image_rect_.height += curve_height;
}

void NextView::draw(const Rect& area) {
  if (frame().number == 0) return;
  place(area);
  painter_.draw_scene(now_rect_, 1);
  painter_.draw_scene(next_rect_, 0);
  const bool is_bridged = frame().origin.kind == MAQ_FRAME_PREDICTED;
  if (choice_.finds_surprise && !frame().surprise.empty()) {
    const bool is_start = frame().surprise.back().score.is_start != 0;  // its bits are of another kind
    if (!is_start) draw_red_cells(frame().surprise_bits, kSurpriseRed, now_rect_);
    draw_surprise_curve(frame().surprise, curve_rect_, window_.scale());
  }
  const std::string ahead_ms = std::to_string(frame().origin.horizon_ns / 1000000);
  mark(now_rect_, is_bridged, is_bridged ? "predicted +" + ahead_ms + " ms" : "now");
  if (choice_.finds_uncertainty) {
    Reddening red = kUncertainRed;
    red.max_red *= float(frame().drawn_freshness);
    draw_red_cells(frame().drawn.bits, red, next_rect_);
  }
  mark(next_rect_, true, maquette::text_of_next(frame(), choice_.finds_uncertainty));
  if (!choice_.draws_sample || frame().drawn.picture.empty()) return;
  painter_.draw_scene(sample_rect_, Painter::kSample);
  mark(sample_rect_, true, maquette::text_of_drawn(frame()));
}

void NextView::mark(const Rect& rect, bool is_predicted, const std::string& text) const {
  ImDrawList* const list = ImGui::GetBackgroundDrawList();
  const float line = 4 * window_.scale(), pad = 4 * window_.scale();
  const ImVec2 from = {float(rect.x), float(rect.y)}, to = {from.x + float(rect.width), from.y + float(rect.height)};
  const float half = line / 2;
  if (is_predicted)
    list->AddRect({from.x + half, from.y + half}, {to.x - half, to.y - half}, kMadeUpColour, 0, 0, line);
  const ImVec2 size = ImGui::CalcTextSize(text.c_str());
  const ImVec2 at = {from.x + line, to.y - line - size.y - 2 * pad};
  list->AddRectFilled(at, {at.x + size.x + 2 * pad, at.y + size.y + 2 * pad},
                      is_predicted ? kMadeUpColour : kDarkColour);
  list->AddText({at.x + pad, at.y + pad}, is_predicted ? IM_COL32_BLACK : IM_COL32_WHITE, text.c_str());
}

void NextView::add_to_report(nlohmann::ordered_json* report) const {
  LiveView::add_to_report(report);
  nlohmann::ordered_json& json = *report;
  json["frames"] = frame().number;
  json["view"] = "next";
  json["frame_px"] = {frame().now.width_px, frame().now.height_px};
  json["now_px"] = window_.in_pixels(now_rect_).numbers();
  json["next_px"] = window_.in_pixels(next_rect_).numbers();
  json["curve_px"] = window_.in_pixels(curve_rect_).numbers();
  json["prediction"] = {{"ahead_ms", frame().ahead_s * 1e3},
                        {"method", kMethodNames[size_t(frame().stats.method)]},
                        {"motion_fraction", frame().stats.motion_fraction},
                        {"push_ms", frame().stats.push_ms},
                        {"predict_ms", frame().stats.predict_ms},
                        {"networks_ms", double(frame().stats.networks_ms)},
                        {"now_is_predicted", frame().origin.kind == MAQ_FRAME_PREDICTED},
                        {"bridges_gaps", frame().bridges_gaps},
                        {"bridged_frames", frame().gaps.predicted_count},
                        {"latest_gap_ms", frame().gaps.latest_gap_ms}};
  json["surprise"] = surprise_report(frame());
  const maquette::DrawnFuture& drawn = frame().drawn;
  json["sample_px"] = window_.in_pixels(sample_rect_).numbers();
  json["drawn"] = {{"number", drawn.number},
                   {"age_ms", frame().drawn_age_ms},
                   {"bits", drawn.mean_bits},
                   {"picture_px", {drawn.picture.width_px, drawn.picture.height_px}}};
}

Action NextView::draw_panel() {
  Action action = draw_source(frame().results_per_second);
  const maq_predictor_stats& stats = frame().stats;
  ImGui::Text("%d x %d, pushed in %.1f ms", frame().now.width_px, frame().now.height_px, double(stats.push_ms));
  ImGui::Text("predicted in %.1f ms by %s", double(stats.predict_ms), maquette::text_of_method(stats).c_str());
  stages_.draw(kPredictionStages, std::size(kPredictionStages), window_.scale());
  bool changed = false;
  float ahead_ms = float(choice_.ahead_s * 1e3);
  if (ImGui::SliderFloat("ahead", &ahead_ms, float(kMinAheadMs), float(kMaxAheadMs), "%.0f ms",
                         ImGuiSliderFlags_AlwaysClamp)) {
    choice_.ahead_s = double(ahead_ms) / 1e3;
    changed = true;
  }
  ImGui::TextUnformatted("Method (1 to 4)");
  for (size_t i = 0; i < kMethodNames.size(); ++i) {
    if (i != 0) ImGui::SameLine(float(i) * 75 * window_.scale());
    const auto method = maq_prediction_method(i);
    if (!ImGui::RadioButton(kMethodNames[i], choice_.method == method)) continue;
    choice_.method = method;
    changed = true;
  }
  draw_pause();
  ImGui::Separator();
  changed |= ImGui::Checkbox("Bridge gaps (B)", &choice_.bridges_gaps);
  draw_gaps();
  changed |= ImGui::Checkbox("Surprise (S)", &choice_.finds_surprise);
  changed |= draw_uncertainty();
  if (changed) live_.set_choice(choice_);
  if (choice_.finds_surprise) draw_surprise_text(frame(), window_.scale());
  ImGui::Separator();
  ImGui::TextWrapped("What has a border in magenta was made up: never steer anything by it.");
  if (ImGui::Button("People (F7)")) action = Action::kNext;
  return action;
}

void NextView::draw_gaps() {
  if (!choice_.bridges_gaps) return;
  if (frame().number > 0 && !frame().bridges_gaps) {
    ImGui::TextWrapped("This source does not play in real time, so that it has no gaps.");
    return;
  }
  ImGui::Text("%llu frames bridged, latest gap %.0f ms", static_cast<unsigned long long>(frame().gaps.predicted_count),
              double(frame().gaps.latest_gap_ms));
}

// True when a switch was changed.
bool NextView::draw_uncertainty() {
  bool changed = ImGui::Checkbox("Uncertainty (U)", &choice_.finds_uncertainty);
  changed |= ImGui::Checkbox("One that may come, drawn (D)", &choice_.draws_sample);
  const maquette::DrawnFuture& drawn = frame().drawn;
  if (drawn.number == 0) return changed;
  ImGui::Text("%.2f bits a code, drawn in %.0f ms, %.0f ms ago", drawn.mean_bits, drawn.draw_ms, frame().drawn_age_ms);
  return changed;
}
