#include "edges_view.h"

#include <GLFW/glfw3.h>
#include <imgui.h>
#include <algorithm>
#include <iterator>
#include <utility>

#include "drawing/edges_drawing.h"

namespace {

constexpr OwnSources kEdgesSources = {kRenderedSolids, "depthai:", kRenderedSolids,
                                      "These solids are rendered; drop a recording of a depth camera here."};
constexpr const char* kEdgesStages[] = {"depth",  "planes", "slopes", "network", "decode",
                                        "curves", "boxes",  "draw",   "wait"};
constexpr std::array<const char*, 5> kFormats = {"json", "obj", "ply", "dxf", "step"};
constexpr const char* kSnapNames[] = {"nothing", "corner", "curve", "plane"};
constexpr float kSnapRadius = 14;  // in units of the window at scale 1

}  // namespace

EdgesView::EdgesView(const maquette::Context& context, const Options& options, const Window& window, Painter& painter)
    : LiveView(options, window, painter, kEdgesSources),
      model_(options.edges_model),
      layer_(options.layer),
      live_(
          context, options.edges_model,
          [this](maquette::PipelineResult found, double rate) {
            frames_.back().take(std::move(found), rate, layer_);
            frames_.publish();
            Window::wake();
          },
          Window::wake, options.live) {
  set_live(&live_);
}

// Meanwhile others drew into the texture.
void EdgesView::set_visible(bool is_visible) {
  LiveView::set_visible(is_visible);
  if (is_visible) upload();
}

bool EdgesView::update() {
  note_end();
  if (!frames_.take()) return false;
  upload();
  const maq_edges_stats& s = frame().stats;
  const maq_edges_curves_stats& c = frame().curves_stats;
  stages_.add({s.depth_ms, s.skip_ms, s.slopes_ms, s.network_ms, s.decode_ms, c.curves_ms, c.boxes_ms,
               float(frame().drawing_ms), float(frame().waiting_ms)});
  return true;
}

void EdgesView::upload() {
  if (frame().number == 0) return;
  const bool is_drawn = frame().layer == layer_;
  if (!is_drawn) maquette::draw_edge_layer(*frame().result, layer_, &redrawn_);
  painter_.set_scene(is_drawn ? frame().picture : redrawn_, {});
}

void EdgesView::set_layer(maquette::EdgeLayer layer) {
  layer_ = layer;
  upload();
}

Action EdgesView::press(int key) {
  if (key >= GLFW_KEY_1 && key <= GLFW_KEY_3) set_layer(maquette::EdgeLayer(key - GLFW_KEY_1));
  const auto toggle = [&](bool* value) {
    *value = !*value;
    live_.set_model(model_);
  };
  if (key == GLFW_KEY_C) toggle(&model_.finds_curves);
  if (key == GLFW_KEY_B) toggle(&model_.finds_boxes);
  if (key == GLFW_KEY_K) {
    model_.edges.skip_planes = 1 - model_.edges.skip_planes;
    live_.set_model(model_);
  }
  return LiveView::press(key);
}

void EdgesView::draw(const Rect& area) {
  pick_ = {};
  if (frame().number == 0) return;
  image_rect_ = area.fit(frame().picture.width_px, frame().picture.height_px);
  painter_.draw_scene(image_rect_, 0);
  if (frame().found == nullptr) return;
  const EdgesDrawing drawing(frame(), image_rect_, window_.scale());
  const std::optional<maquette::Pixel> at = pointer(drawing);
  if (at) pick_ = frame().pick((*at)[0], (*at)[1], double(kSnapRadius * window_.scale() / drawing.units_per_px()));
  drawing.outlines();
  drawing.curves(pick_.curve);
  drawing.lengths();
  drawing.legend();
  if (at) drawing.pointer(pick_, *at);
}

// The pixel that the user points to.
std::optional<maquette::Pixel> EdgesView::pointer(const EdgesDrawing& drawing) const {
  if (!options_.pointer_px.empty()) return maquette::Pixel{options_.pointer_px[0], options_.pointer_px[1]};
  const ImVec2 at = ImGui::GetIO().MousePos;
  if (!ImGui::IsMousePosValid(&at) || ImGui::GetIO().WantCaptureMouse) return std::nullopt;
  const maquette::Pixel pixel = drawing.frame_pixel(at);
  const bool is_inside = pixel[0] >= -0.5 && pixel[0] < frame().picture.width_px - 0.5 && pixel[1] >= -0.5 &&
                         pixel[1] < frame().picture.height_px - 0.5;
  return is_inside ? std::optional(pixel) : std::nullopt;
}

maquette::Saver::Companions EdgesView::companions() const {
  if (frame().result == nullptr) return nullptr;
  return [result = frame().result, found = frame().found, formats = formats_](const std::string& path) {
    result->save(path);
    std::string names = "_distance.png, _kind.png, _edges.json";
    for (size_t i = 0; i < kFormats.size() && found != nullptr; ++i) {
      if (!formats[i]) continue;
      const std::string ending = std::string("_curves.") + kFormats[i];
      found->save(path + ending);
      names += ", " + ending;
    }
    return names;
  };
}

void EdgesView::add_to_report(nlohmann::ordered_json* report) const {
  LiveView::add_to_report(report);
  nlohmann::ordered_json& json = *report;
  json["frames"] = frame().number;
  json["view"] = "edges";
  json["frame_px"] = {frame().picture.width_px, frame().picture.height_px};
  json["edges"] = {{"layer", maquette::kEdgeLayerNames[size_t(layer_.load())]},
                   {"network_pixels", frame().stats.network_pixel_count},
                   {"curves", frame().curves.size()},
                   {"corners", frame().corners.size()},
                   {"boxes", nlohmann::json::array()},
                   {"at_pointer", nullptr}};
  for (const maq_edges_box& box : frame().boxes) {
    json["edges"]["boxes"].push_back({{"size_m", box.size_m}, {"size_tolerance_m", box.size_tolerance_m}});
  }
  if (pick_.curve < 0) return;
  json["edges"]["at_pointer"] = {{"curve", pick_.curve},
                                 {"length_m", frame().curves[size_t(pick_.curve)].length_m},
                                 {"snap", kSnapNames[pick_.snap.target]},
                                 {"point_m", pick_.snap.point_m}};
}

Action EdgesView::draw_panel() {
  Action action = draw_source(frame().results_per_second);
  const maquette::EdgesFrame& shown = frame();
  ImGui::Text("%d x %d in %.1f ms, curves in %.1f ms", shown.picture.width_px, shown.picture.height_px,
              double(shown.stats.total_ms), double(shown.curves_stats.curves_ms + shown.curves_stats.boxes_ms));
  if (shown.age_ms >= 0) ImGui::Text("from camera to result: %.0f ms", shown.age_ms);
  stages_.draw(kEdgesStages, std::size(kEdgesStages), window_.scale());
  ImGui::Text("%zu curves, %zu corners", shown.curves.size(), shown.corners.size());
  for (const maq_edges_box& box : shown.boxes) ImGui::TextWrapped("box of %s", text_of(box).c_str());
  draw_layers();
  ImGui::Separator();
  ImGui::TextWrapped("%s", options_.edges_bundle.substr(options_.edges_bundle.rfind('/') + 1).c_str());
  draw_model_options();
  draw_formats();
  if (ImGui::Button("People (F5)")) action = Action::kOtherView;
  return action;
}

void EdgesView::draw_layers() {
  ImGui::TextUnformatted("Layers (1 to 3)");
  for (size_t layer = 0; layer < maquette::kEdgeLayerNames.size(); ++layer) {
    if (layer != 0) ImGui::SameLine(float(layer) * 100 * window_.scale());
    const auto value = maquette::EdgeLayer(layer);
    if (ImGui::RadioButton(maquette::kEdgeLayerNames[layer], layer_ == value)) set_layer(value);
  }
  draw_pause();
}

// Options that are switched off are not computed.
void EdgesView::draw_model_options() {
  bool changed = ImGui::Checkbox("curves (C)", &model_.finds_curves);
  ImGui::SameLine(150 * window_.scale());
  changed |= ImGui::Checkbox("boxes (B)", &model_.finds_boxes);
  const int64_t pixels = int64_t(frame().picture.width_px) * frame().picture.height_px;
  changed |= ImGui::CheckboxFlags("skip planes (K)", &model_.edges.skip_planes, 1);
  ImGui::SameLine(150 * window_.scale());
  ImGui::Text("network on %.0f %%",
              100.0 * double(frame().stats.network_pixel_count) / double(std::max<int64_t>(1, pixels)));
  if (changed) live_.set_model(model_);
}

void EdgesView::draw_formats() {
  ImGui::TextUnformatted("Curves in a snapshot");
  for (size_t i = 0; i < kFormats.size(); ++i) {
    if (i != 0) ImGui::SameLine();
    ImGui::Checkbox(kFormats[i], &formats_[i]);
  }
}
