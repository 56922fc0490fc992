// The panel at the right: what runs, how long it takes, and the switches.
#include <imgui.h>
#include <sys/resource.h>
#include <unistd.h>
#include <algorithm>
#include <fstream>
#include <thread>

#include "app.h"

namespace {

constexpr const char* kStages[] = {"trunk", "proposals", "box head", "dense head", "decode", "resize", "copy", "wait"};
constexpr ImU32 kStageColours[] = {IM_COL32(88, 140, 232, 255),  IM_COL32(80, 200, 200, 255),
                                   IM_COL32(100, 200, 110, 255), IM_COL32(236, 190, 70, 255),
                                   IM_COL32(240, 130, 60, 255),  IM_COL32(214, 90, 110, 255),
                                   IM_COL32(170, 110, 210, 255), IM_COL32(110, 110, 118, 255)};

double process_cpu_s() {
  rusage used{};
  getrusage(RUSAGE_SELF, &used);
  const auto seconds = [](const timeval& time) { return double(time.tv_sec) + double(time.tv_usec) * 1e-6; };
  return seconds(used.ru_utime) + seconds(used.ru_stime);
}

double process_memory_mb() {
  long pages = 0, resident = 0;
  std::ifstream("/proc/self/statm") >> pages >> resident;
  return double(resident) * double(sysconf(_SC_PAGESIZE)) / 1e6;
}

}  // namespace

void App::draw_panel(int width_px) {
  const Rect all = window_.rect();
  ImGui::SetNextWindowPos({float(all.width - width_px), 0});
  ImGui::SetNextWindowSize({float(width_px), float(all.height)});
  ImGui::Begin("panel", nullptr, ImGuiWindowFlags_NoTitleBar | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoResize);
  if (ImGui::IsWindowAppearing()) ImGui::SetWindowFocus(nullptr);  // arrows are the picture's at first
  ImGui::PushItemWidth(-110 * window_.scale());
  const double now = ImGui::GetTime();
  if (now - cpu_at_s_ > 1) {
    const double used = process_cpu_s();
    cpu_percent_ = 100 * (used - cpu_s_) / (now - cpu_at_s_);
    memory_mb_ = process_memory_mb();
    cpu_at_s_ = now, cpu_s_ = used;
  }
  if (shows_scene_) {
    draw_scene_panel();
  } else {
    draw_people_panel();
  }
  if (memory_mb_ > 0) {
    ImGui::Text("CPU %.0f %% of %u cores, memory %.0f MB", cpu_percent_, std::thread::hardware_concurrency(),
                memory_mb_);
  } else {
    ImGui::TextUnformatted("CPU and memory: in a second");
  }
  ImGui::Separator();
  if (ImGui::Button("Snapshot (F2)")) take_snapshot();
  ImGui::SameLine();
  if (ImGui::Button(clip_file_ ? "End clip (F3)" : "Clip (F3)")) toggle_clip();
  ImGui::SameLine();
  if (ImGui::Button("Help (F1)")) help_ = true;
  if (!shows_scene_ && ImGui::Button(recording_.empty() ? "Record the source (F4)" : "End recording (F4)")) {
    toggle_recording();
  }
  ImGui::End();
}

void App::draw_people_panel() {
  const maquette::LiveStatus status = people_.status();
  const MappedFrame& frame = mapped_.front();
  ImGui::TextWrapped("%s", status.uri.c_str());
  if (ImGui::SmallButton("Look for a camera")) open(kFirstCamera);
  ImGui::Text("%.1f frames a second, %llu lost", frame.fps, static_cast<unsigned long long>(status.drops));
  ImGui::Text("%.1f ms a frame, %d %s%s", double(frame.stats.total_ms), frame.stats.person_count,
              frame.stats.person_count == 1 ? "person" : "people", frame.stats.is_key_frame != 0 ? "" : ", followed");
  if (frame.age_ms >= 0) ImGui::Text("from camera to result: %.0f ms", frame.age_ms);
  draw_stages(kStages, std::size(kStages));

  ImGui::TextUnformatted("Views (1 to 6)");
  for (size_t view = 0; view < kViewNames.size(); ++view) {
    if (view % 3 != 0) ImGui::SameLine(float(view % 3) * 100 * window_.scale());
    if (ImGui::RadioButton(kViewNames[view], options_.view == View(view))) options_.view = View(view);
  }
  ImGui::Checkbox("body surface (M)", &options_.mesh);
  ImGui::SameLine();
  if (ImGui::Checkbox("pause (P)", &paused_)) people_.pause(paused_);
  if (options_.view == View::kTryOn) ImGui::TextWrapped("Drop a picture to wear it.");

  ImGui::Separator();
  ImGui::TextWrapped("%s, %d x %d", options_.bundle.substr(options_.bundle.rfind('/') + 1).c_str(),
                     frame.stats.network_width_px, frame.stats.network_height_px);
  const int cores = int(std::max(1u, std::thread::hardware_concurrency()));
  bool changed = false;
  // Loading takes a moment, so a slider counts when it is let go.
  const auto slider = [&](const char* name, int* value, int least, int most, const char* format) {
    ImGui::SliderInt(name, value, least, most, format, ImGuiSliderFlags_AlwaysClamp);
    changed |= ImGui::IsItemDeactivatedAfterEdit();
  };
  slider("threads", &options_.model.threads, 0, cores, options_.model.threads == 0 ? "all cores" : "%d");
  slider("key frames", &options_.model.key_frame_interval, 1, 30,
         options_.model.key_frame_interval == 1 ? "every" : "one in %d");
  slider("long side", &options_.model.long_side_px, 0, 1024,
         options_.model.long_side_px == 0 ? "the model's" : "%d px");
  if (options_.model.long_side_px > 0) options_.model.long_side_px = std::max(64, options_.model.long_side_px);
  bool parts_alone = options_.model.detail == MAQ_DENSEPOSE_DETAIL_PART;
  if (ImGui::Checkbox("parts alone, no U and V", &parts_alone)) {
    options_.model.detail = parts_alone ? MAQ_DENSEPOSE_DETAIL_PART : MAQ_DENSEPOSE_DETAIL_SURFACE;
    changed = true;
  }
  changed |= ImGui::CheckboxFlags("threads stay awake", &options_.model.allow_spinning, 1);
  if (changed) people_.set(options_.model);
}

// Milliseconds of each stage over the last frames, one upon the other.
void App::draw_stages(const char* const* names, size_t count) {
  const float width = ImGui::GetContentRegionAvail().x, height = 110 * window_.scale();
  const ImVec2 from = ImGui::GetCursorScreenPos(), to(from.x + width, from.y + height);
  ImDrawList* const list = ImGui::GetWindowDrawList();
  list->AddRectFilled(from, to, IM_COL32(28, 28, 32, 255));
  std::vector<float> totals;
  for (const Stages& stages : stages_) {
    float sum = 0;
    for (size_t k = 0; k < count; ++k) sum += stages.ms[k];
    totals.push_back(sum);
  }
  std::sort(totals.begin(), totals.end());
  // A rare long frame is cut off rather than making the others small.
  const float full_ms = totals.empty() ? 1 : std::max(1.0f, 1.25f * totals[totals.size() * 95 / 100]);
  const float step = width / 200;
  for (size_t i = 0; i < stages_.size(); ++i) {
    float top = to.y;
    for (size_t k = 0; k < count; ++k) {
      const float next = std::max(from.y, top - stages_[i].ms[k] / full_ms * height), x = from.x + float(i) * step;
      if (next < top) list->AddRectFilled({x, next}, {x + step, top}, kStageColours[k]);
      top = next;
    }
  }
  char text[40];
  std::snprintf(text, sizeof text, "%.0f ms", double(full_ms));
  list->AddText({from.x + 4, from.y + 2}, IM_COL32(200, 200, 200, 255), text);
  ImGui::Dummy({width, height + 2});
  for (size_t k = 0; k < count; ++k) {
    if (k % 2 != 0) ImGui::SameLine(width / 2);
    ImGui::TextColored(ImColor(kStageColours[k]), "%s %.1f ms", names[k],
                       stages_.empty() ? 0.0 : double(stages_.back().ms[k]));
  }
  ImGui::Separator();
}

void App::draw_help() {
  const Rect all = window_.rect();
  ImGui::SetNextWindowPos({float(all.width) / 2, float(all.height) / 2}, 0, {0.5f, 0.5f});
  ImGui::Begin("Help", &help_, ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoCollapse);
  ImGui::TextUnformatted(
      "Drop a photo, a clip, a recording, a scene (.maqs) or a folder with a capture here.\n"
      "In the try-on view a dropped picture is worn.\n\n");
  constexpr const char* kKeys[][2] = {
      {"1 to 6", "camera, parts, U/V contours, mask, boxes, try-on"},
      {"M", "the body's surface in the corner; drag or use the arrows to turn it"},
      {"P", "pause"},
      {"F2", "snapshot: the picture, and IUV, INDS and JSON of the people"},
      {"F3", "clip of the picture (.mp4): begin, end"},
      {"F4", "recording of the source (.maqrec), to be played here again: begin, end"},
      {"W A S D, Q E", "fly through a scene, down and up; mouse or arrows look, the wheel zooms"},
      {"N  ,  .", "nearest photo of the scene, the one before, the next"},
      {"C", "photo against rendering: off, slider, error"},
      {"X", "from the scene back to people"},
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
