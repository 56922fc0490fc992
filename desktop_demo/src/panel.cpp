#include "panel.h"

#include <imgui.h>
#include <thread>

Action Panel::draw(const Rect& rect, MainView& view, bool has_clip) {
  ImGui::SetNextWindowPos({float(rect.x), float(rect.y)});
  ImGui::SetNextWindowSize({float(rect.width), float(rect.height)});
  ImGui::Begin("panel", nullptr, ImGuiWindowFlags_NoTitleBar | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoResize);
  if (ImGui::IsWindowAppearing()) ImGui::SetWindowFocus(nullptr);  // arrows are the image's at first
  ImGui::PushItemWidth(-110 * window_.scale());
  Action action = view.draw_panel();
  draw_load();
  ImGui::Separator();
  if (ImGui::Button("Snapshot (F2)")) action = Action::kSnapshot;
  ImGui::SameLine();
  if (ImGui::Button(has_clip ? "End clip (F3)" : "Clip (F3)")) action = Action::kClip;
  ImGui::SameLine();
  if (ImGui::Button("Help (F1)")) action = Action::kHelp;
  ImGui::End();
  return action;
}

void Panel::draw_load() {
  load_.update();
  if (load_.memory_mb() > 0) {
    ImGui::Text("CPU %.0f %% of %u cores, memory %.0f MB", load_.cpu_percent(), std::thread::hardware_concurrency(),
                load_.memory_mb());
  } else {
    ImGui::TextUnformatted("CPU and memory: in a second");
  }
}

void Panel::draw_help(bool* is_open) const {
  const Rect all = window_.rect();
  ImGui::SetNextWindowPos({float(all.width) / 2, float(all.height) / 2}, 0, {0.5f, 0.5f});
  ImGui::Begin("Help", is_open, ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoCollapse);
  ImGui::TextUnformatted(
      "Drop a photo, a clip, a recording, a scene (.maqs, .ply, .spz) or a folder with a capture here.\n"
      "In the try-on view a dropped picture is worn.\n\n");
  constexpr const char* kKeys[][2] = {
      {"1 to 6", "camera, parts, U/V contours, mask, boxes, try-on"},
      {"M, C", "the body's surface in the corner; in the person's colours; drag or use the arrows to turn it"},
      {"P", "pause"},
      {"F2", "snapshot: the picture, and the files of what was found in it"},
      {"F3", "clip of the picture (.mp4): begin, end"},
      {"F4", "recording of the source (.maqrec), to be played here again: begin, end"},
      {"W A S D, Q E", "fly through a scene, down and up; mouse or arrows look, the wheel zooms"},
      {"N  ,  .", "nearest photo of the scene, the one before, the next"},
      {"C", "photo against rendering: off, slider, error"},
      {"X", "from the scene or the head back to people"},
      {"G, A", "a head of the largest person in the picture; A: the picture is added to the head so far"},
      {"1 to 5, C, E, Esc", "head: colour, shape, normals, template, depth; over the photo; export; cancel the fit"},
      {"F5", "edges of a depth camera; again: people"},
      {"1 to 3, C, B, K", "edges: depth, distance, plain; curves, boxes; planes are skipped"},
      {"F7", "prediction: the source and its predicted frame; again: people"},
      {"1 to 3, B, S, arrows", "prediction: auto, last, motion; conceal gaps; camera health; time ahead (or drag)"},
      {"U, D", "prediction: entropy in red; one sampled future"},
      {"F6", "into the panel: arrows, Space, Enter; again: back to the picture"},
      {"H, F11", "panel, full screen"},
      {"Ctrl+Q", "ends the program"}};
  for (const auto& [key, what] : kKeys) {
    ImGui::TextUnformatted(key);
    ImGui::SameLine(110 * window_.scale());
    ImGui::TextUnformatted(what);
  }
  ImGui::End();
}
