#include "prediction_view.h"

#include <GLFW/glfw3.h>
#include <app/tiling.h>
#include <imgui.h>
#include <algorithm>
#include <cmath>
#include <iterator>

#include "drawing/health_drawing.h"

namespace {

constexpr OwnSources kPredictedSources = {kFirstCamera, kFirstCamera, "stub:people?count=2",
                                          "These people are rendered; drop a clip or a recording here."};
constexpr const char* kPredictionStages[] = {"luma", "flow", "weights", "project", "warp", "wait", "network"};
constexpr float kCurveHeight = 90;
constexpr double kAheadSPerRadian = 0.3;  // drags and arrows turn something in other views
constexpr Reddening kUnexplainedRed = {0.3f, 0.8f, 0.7f}, kEntropyRed = {1, 6, 0.6f};
constexpr int kEntropyCells = 16;  // a side
constexpr ImU32 kPredictedColour = IM_COL32(255, 0, 255, 255), kDarkColour = IM_COL32(20, 20, 24, 220);

}  // namespace

PredictionView::PredictionView(const maquette::Context& context, const Options& options, const Window& window,
                               Painter& painter)
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

// Other views drew into the textures meanwhile.
void PredictionView::set_visible(bool is_visible) {
  LiveView::set_visible(is_visible);
  if (is_visible && frame().number > 0) painter_.set_scene(frame().next, frame().now, frame().sampled.image);
}

bool PredictionView::update() {
  note_end();
  if (!frames_.take()) return false;
  painter_.set_scene(frame().next, frame().now, frame().sampled.image);
  const maq_predictor_stats& s = frame().stats;
  stages_.add({s.luma_ms, s.flow_ms, s.weights_ms, s.project_ms, s.warp_ms, float(frame().waiting_ms), s.networks_ms});
  return true;
}

Action PredictionView::press(int key) {
  if (key >= GLFW_KEY_1 && key <= GLFW_KEY_3) choice_.method = maq_predictor_method(key - GLFW_KEY_1);
  if (key == GLFW_KEY_B) choice_.conceals_gaps = !choice_.conceals_gaps;
  if (key == GLFW_KEY_S) choice_.checks_camera = !choice_.checks_camera;
  if (key == GLFW_KEY_U) choice_.shows_entropy = !choice_.shows_entropy;
  if (key == GLFW_KEY_D) choice_.shows_sample = !choice_.shows_sample;
  live_.set_choice(choice_);
  return LiveView::press(key);
}

void PredictionView::steer(const Steering& steering, const Rect&) {
  if (steering.right == 0) return;
  choice_.ahead_s =
      std::clamp(choice_.ahead_s + kAheadSPerRadian * double(steering.right), kMinAheadMs / 1e3, kMaxAheadMs / 1e3);
  live_.set_choice(choice_);
}

// Uses the number of columns that makes the images largest; the curve of camera health is below.
void PredictionView::place(Rect area) {
  const int curve_height = choice_.checks_camera ? std::min(int(kCurveHeight * window_.scale()), area.height / 4) : 0;
  area.height -= curve_height;
  const maquette::Tiling one = maquette::tile(choice_.shows_sample ? 3 : 2, area.width, area.height,
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

void PredictionView::draw(const Rect& area) {
  if (frame().number == 0) return;
  place(area);
  painter_.draw_scene(now_rect_, 1);
  painter_.draw_scene(next_rect_, 0);
  const bool is_concealed = frame().origin.kind == MAQ_FRAME_PREDICTED;
  if (choice_.checks_camera && !frame().health.empty()) {
    draw_red_cells(frame().health_map, frame().health.back().result.columns, kUnexplainedRed, now_rect_);
    draw_health_curve(frame().health, curve_rect_, window_.scale());
  }
  const std::string ahead_ms = std::to_string(frame().origin.horizon_ns / 1000000);
  mark(now_rect_, is_concealed, is_concealed ? "predicted +" + ahead_ms + " ms" : "now");
  if (choice_.shows_entropy) {
    Reddening red = kEntropyRed;
    red.max_red *= float(frame().sample_freshness);
    draw_red_cells(frame().sampled.bits, kEntropyCells, red, next_rect_);
  }
  mark(next_rect_, true, maquette::text_of_next(frame(), choice_.shows_entropy));
  if (!choice_.shows_sample || frame().sampled.image.empty()) return;
  painter_.draw_scene(sample_rect_, Painter::kSample);
  mark(sample_rect_, true, maquette::text_of_sample(frame()));
}

void PredictionView::mark(const Rect& rect, bool is_predicted, const std::string& text) const {
  ImDrawList* const list = ImGui::GetBackgroundDrawList();
  const float line = 4 * window_.scale(), pad = 4 * window_.scale();
  const ImVec2 from = {float(rect.x), float(rect.y)}, to = {from.x + float(rect.width), from.y + float(rect.height)};
  const float half = line / 2;
  if (is_predicted)
    list->AddRect({from.x + half, from.y + half}, {to.x - half, to.y - half}, kPredictedColour, 0, 0, line);
  const ImVec2 size = ImGui::CalcTextSize(text.c_str());
  const ImVec2 at = {from.x + line, to.y - line - size.y - 2 * pad};
  list->AddRectFilled(at, {at.x + size.x + 2 * pad, at.y + size.y + 2 * pad},
                      is_predicted ? kPredictedColour : kDarkColour);
  list->AddText({at.x + pad, at.y + pad}, is_predicted ? IM_COL32_BLACK : IM_COL32_WHITE, text.c_str());
}

void PredictionView::add_to_report(nlohmann::ordered_json* report) const {
  LiveView::add_to_report(report);
  nlohmann::ordered_json& json = *report;
  json["frames"] = frame().number;
  json["view"] = "prediction";
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
                        {"conceals_gaps", frame().conceals_gaps},
                        {"concealed_frames", frame().gaps.predicted_count},
                        {"latest_gap_ms", frame().gaps.latest_gap_ms}};
  json["health"] = health_report(frame());
  const maquette::SampledFuture& sampled = frame().sampled;
  json["sample_px"] = window_.in_pixels(sample_rect_).numbers();
  json["sample"] = {{"number", sampled.number},
                    {"age_ms", frame().sample_age_ms},
                    {"bits", sampled.mean_bits},
                    {"image_px", {sampled.image.width_px, sampled.image.height_px}}};
}

Action PredictionView::draw_panel() {
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
  ImGui::TextUnformatted("Method (1 to 3)");
  for (size_t i = 0; i < kMethodNames.size(); ++i) {
    if (i != 0) ImGui::SameLine(float(i) * 75 * window_.scale());
    const auto method = maq_predictor_method(i);
    if (!ImGui::RadioButton(kMethodNames[i], choice_.method == method)) continue;
    choice_.method = method;
    changed = true;
  }
  draw_pause();
  ImGui::Separator();
  changed |= ImGui::Checkbox("Conceal gaps (B)", &choice_.conceals_gaps);
  draw_gaps();
  changed |= ImGui::Checkbox("Camera health (S)", &choice_.checks_camera);
  changed |= draw_entropy_text();
  if (changed) live_.set_choice(choice_);
  if (choice_.checks_camera) draw_health_text(frame(), window_.scale());
  ImGui::Separator();
  ImGui::TextWrapped("Images with a magenta border are predicted: never steer anything by them.");
  if (ImGui::Button("People (F7)")) action = Action::kPrediction;
  return action;
}

void PredictionView::draw_gaps() {
  if (!choice_.conceals_gaps) return;
  if (frame().number > 0 && !frame().conceals_gaps) {
    ImGui::TextWrapped("This source does not play in real time, so it has no gaps.");
    return;
  }
  ImGui::Text("%llu frames predicted, latest gap %.0f ms",
              static_cast<unsigned long long>(frame().gaps.predicted_count), double(frame().gaps.latest_gap_ms));
}

// Returns whether a switch was changed.
bool PredictionView::draw_entropy_text() {
  bool changed = ImGui::Checkbox("Entropy (U)", &choice_.shows_entropy);
  changed |= ImGui::Checkbox("Sampled future (D)", &choice_.shows_sample);
  const maquette::SampledFuture& sampled = frame().sampled;
  if (sampled.number == 0) return changed;
  ImGui::Text("%.2f bits a code, sampled in %.0f ms, %.0f ms ago", sampled.mean_bits, sampled.sample_ms,
              frame().sample_age_ms);
  return changed;
}
