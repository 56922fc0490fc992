#include "app.h"

#include <GLFW/glfw3.h>
#include <imgui.h>
#include <algorithm>
#include <cstdio>
#include <filesystem>

namespace fs = std::filesystem;

namespace {

constexpr int kMaxOutfitPx = 4096;
// Between two frames, while the picture moves and while nothing happens.
constexpr double kMovingS = 0.016, kIdleS = 0.25;

// A path as a URI of the library, which says what is wrong with it.
std::string uri_of(const std::string& path_or_uri) {
  std::error_code error;
  if (!fs::exists(path_or_uri, error) && path_or_uri.find(':') != std::string::npos) return path_or_uri;
  std::string uri = "file:";
  for (const char c : path_or_uri) uri += c == '?' ? "%3F" : c == '%' ? "%25" : std::string(1, c);
  return uri;
}

}  // namespace

App::App(const Options& options)
    : options_(options),
      headless_(options),
      window_("Maquette", options.width_px, options.height_px, !options.headless),
      painter_(window_),
      panel_(window_),
      people_(context_, window_, painter_, options),
      scene_(context_, window_, painter_, options),
      shows_panel_(options.panel),
      saver_(context_, options.out) {
  if (!options.texture.empty()) load_outfit(options.texture);
  open(options.source);
}

int App::run() {
  maquette::RgbaImage last;
  double before_s = monotonic_s();
  while (!window_.is_closing()) {
    window_.wait(shows_scene_ && scene_.is_moving() ? kMovingS : kIdleS);
    const double begin_s = monotonic_s();
    draw_frame(begin_s - before_s);
    before_s = begin_s;
    const bool is_done = options_.headless && (shows_scene_ ? headless_.is_done(scene_) : headless_.is_done(people_));
    if (is_done) last = window_.read_pixels(window_.rect());
    window_.show();
    headless_.add_frame(begin_s);
    if (is_done) window_.close();
  }
  saver_.end_clip();
  window_.hide();  // before it waits for the threads
  if (!options_.headless) return 0;
  if (!options_.screenshot.empty() && !last.empty()) last.as_frame(context_).save(options_.screenshot);
  std::puts(headless_.report(people_, shows_scene_ ? &scene_ : nullptr, window_).c_str());
  const std::string failure = shows_scene_ ? headless_.failure(scene_) : headless_.failure(people_);
  if (failure.empty()) return 0;
  std::fprintf(stderr, "maquette-demo: %s\n", failure.c_str());
  return 1;
}

void App::draw_frame(double seconds) {
  take_drops();
  if (outfits_.take()) painter_.set_outfit(outfits_.front());
  const bool has_people = people_.update(), has_scene = scene_.update();
  has_new_image_ = shows_scene_ ? has_scene : has_people;
  take_keys();
  steer(float(std::min(0.1, seconds)));
  window_.begin_drawing();
  draw();
  window_.end_drawing();
  if (saver_.has_clip() && has_new_image_) saver_.add_to_clip(window_, image_rect());
}

void App::open(const std::string& path_or_uri) {
  std::error_code error;
  shows_scene_ = fs::is_directory(path_or_uri, error) || fs::path(path_or_uri).extension() == ".maqs";
  people_.set_visible(!shows_scene_);
  if (shows_scene_) return scene_.open(path_or_uri);
  scene_.close();
  saver_.forget_recording();
  people_.open(path_or_uri == kFirstCamera ? path_or_uri : uri_of(path_or_uri));
}

void App::show_people() {
  if (!people_.has_source()) return open(kFirstCamera);
  shows_scene_ = false;
  scene_.close();
  people_.set_visible(true);
}

void App::load_outfit(const std::string& path) {
  saver_.run([this, path] {
    const auto frame = maquette::Source(context_, uri_of(path)).next();
    if (!frame || std::max(frame->desc().width_px, frame->desc().height_px) > kMaxOutfitPx) {
      return path + " cannot be worn: its sides must be up to " + std::to_string(kMaxOutfitPx) + " pixels.";
    }
    outfits_.back().copy_from(*frame);
    outfits_.publish();
    Window::wake();
    return std::string();
  });
}

void App::take_drops() {
  for (const std::string& path : window_.take_drops()) {
    // In the try-on view a dropped picture is something to wear.
    if (people_.view() == View::kTryOn && !shows_scene_) {
      load_outfit(path);
    } else {
      open(path);
    }
  }
}

void App::take_keys() {
  for (const int key : window_.take_keys()) {
    if (ImGui::GetIO().WantTextInput) continue;
    switch (key) {
      case GLFW_KEY_H: shows_panel_ = !shows_panel_; break;
      case GLFW_KEY_X: perform(shows_scene_ ? Action::kLeaveScene : Action::kNone); break;
      case GLFW_KEY_F1: perform(Action::kHelp); break;
      case GLFW_KEY_F2: perform(Action::kSnapshot); break;
      case GLFW_KEY_F3: perform(Action::kClip); break;
      case GLFW_KEY_F4: perform(Action::kRecord); break;
      case GLFW_KEY_F6: ImGui::SetWindowFocus(ImGui::GetIO().NavActive ? nullptr : "panel"); break;
      case GLFW_KEY_F11: window_.toggle_full_screen(); break;
      case GLFW_KEY_ESCAPE: shows_help_ = false; break;
      default:
        people_.press(key);
        if (shows_scene_) scene_.press(key);
    }
  }
}

// Arrows, and the mouse where it was pressed.
void App::steer(float seconds) {
  const ImGuiIO& io = ImGui::GetIO();
  Steering steering;
  steering.seconds = seconds;
  steering.is_dragging = !io.WantCaptureMouse && ImGui::IsMouseDown(ImGuiMouseButton_Left);
  steering.has_begun = steering.is_dragging && ImGui::IsMouseClicked(ImGuiMouseButton_Left);
  steering.pointer_x = io.MousePos.x;
  if (steering.is_dragging) steering.drag_x = io.MouseDelta.x, steering.drag_y = io.MouseDelta.y;
  const float arrows = io.NavActive ? 0 : seconds * 1.5f;
  steering.arrow_x = window_.held(GLFW_KEY_RIGHT, GLFW_KEY_LEFT) * arrows;
  steering.arrow_y = window_.held(GLFW_KEY_DOWN, GLFW_KEY_UP) * arrows;
  if (shows_scene_) {
    scene_.steer(steering, area_);
  } else {
    people_.steer(steering);
  }
}

void App::draw() {
  const Rect all = window_.rect();
  const int panel_px = shows_panel_ ? std::min(int(330 * window_.scale()), all.width / 2) : 0;
  area_ = {0, 0, std::max(1, all.width - panel_px), all.height};
  if (shows_scene_) {
    scene_.draw(area_);
  } else {
    people_.draw(area_);
  }
  draw_message(area_);
  if (shows_panel_) {
    const auto draw_view = [&] { return shows_scene_ ? scene_.draw_panel() : people_.draw_panel(); };
    perform(panel_.draw({all.width - panel_px, 0, panel_px, all.height}, draw_view, !shows_scene_,
                        saver_.is_recording(), saver_.has_clip()));
  }
  if (shows_help_) panel_.draw_help(&shows_help_);
}

// Over the picture: why there is none, what is being done, what was saved.
void App::draw_message(const Rect& area) {
  std::string text = shows_scene_ ? scene_.message() : people_.message();
  const std::string saved = saver_.message();
  if (!saved.empty()) text += (text.empty() ? "" : "\n") + saved;
  if (text.empty()) return;
  const float margin = 10 * window_.scale(), width = float(area.width) - 4 * margin;
  const ImVec2 size = ImGui::CalcTextSize(text.c_str(), nullptr, false, width);
  ImDrawList* const list = ImGui::GetBackgroundDrawList();
  list->AddRectFilled({margin, margin}, {size.x + 3 * margin, size.y + 3 * margin}, IM_COL32(20, 20, 24, 220),
                      margin / 2);
  list->AddText(ImGui::GetFont(), ImGui::GetFontSize(), {2 * margin, 2 * margin}, IM_COL32(255, 214, 120, 255),
                text.c_str(), nullptr, width);
}

void App::perform(Action action) {
  switch (action) {
    case Action::kNone: break;
    case Action::kOpenCamera: open(kFirstCamera); break;
    case Action::kLeaveScene: show_people(); break;
    case Action::kHelp: shows_help_ = !shows_help_; break;
    case Action::kSnapshot:
      saver_.save_snapshot(window_.read_pixels(image_rect()), shows_scene_ ? nullptr : people_.frame().result);
      break;
    case Action::kClip:
      if (saver_.has_clip()) {
        saver_.end_clip();
      } else {
        saver_.begin_clip(image_rect(), shows_scene_ ? 25 : std::max(1.0, people_.frame().results_per_second));
      }
      break;
    case Action::kRecord: people_.set_recording(saver_.toggle_recording()); break;
  }
}
