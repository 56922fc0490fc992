#include "app.h"

#include <GLFW/glfw3.h>
#include <imgui.h>
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <utility>

namespace fs = std::filesystem;

namespace {

constexpr int kMaxOutfitPx = 4096;
// Between two frames, while the image moves and while nothing happens.
constexpr double kMovingS = 0.016, kIdleS = 0.25;
constexpr float kArrowSpeed = 1.5f, kDragSpeed = 0.005f;  // radians a second, radians a unit of the window

}  // namespace

App::App(const Options& options)
    : options_(options),
      window_("Maquette", options.width_px, options.height_px, !options.headless),
      painter_(window_),
      panel_(window_),
      people_(context_, options, window_, painter_),
      edges_(context_, options, window_, painter_),
      prediction_(context_, options, window_, painter_),
      scene_(context_, options, window_, painter_),
      head_(context_, options, window_, painter_),
      seeks_head_(options.head),
      saver_(context_, options.out) {
  if (!options.texture.empty()) load_outfit(options.texture);
  if (options.edges) live_ = &edges_;
  if (options.predict) live_ = &prediction_;
  open(options.source);
}

int App::run() {
  maquette::RgbaImage last;
  double before_s = monotonic_s();
  while (!window_.is_closing()) {
    window_.wait(view_->is_moving() ? kMovingS : kIdleS);
    const double begin_s = monotonic_s();
    draw_frame(begin_s - before_s);
    before_s = begin_s;
    const bool is_done = options_.headless && view_->act_alone();
    if (is_done) last = window_.read_pixels(window_.rect());
    window_.show();
    times_.add(begin_s, monotonic_s());
    if (is_done) window_.close();
  }
  window_.hide();  // before it waits for the threads
  return options_.headless ? report(last) : 0;
}

void App::draw_frame(double seconds) {
  take_drops();
  if (outfits_.take()) painter_.set_outfit(outfits_.front());
  bool has_new_image = view_->update();
  if (seeks_head_ && has_new_image) {
    seeks_head_ = false;
    show_head(false);
    has_new_image = false;
  }
  take_keys();
  const Rect all = window_.rect();
  const int panel_px = shows_panel_ ? std::min(int(330 * window_.scale()), all.width / 2) : 0;
  const Rect area = {0, 0, std::max(1, all.width - panel_px), all.height};
  steer(float(std::min(0.1, seconds)), area);
  window_.begin_drawing();
  view_->draw(area);
  draw_message(area);
  if (shows_panel_) perform(panel_.draw({all.width - panel_px, 0, panel_px, all.height}, *view_, saver_.has_clip()));
  if (shows_help_) panel_.draw_help(&shows_help_);
  window_.end_drawing();
  if (has_new_image && saver_.takes_clip_images()) saver_.add_to_clip(window_.read_pixels(view_->image_rect()));
}

void App::take_drops() {
  for (const std::string& path : window_.take_drops()) {
    // In the try-on view a dropped image is something to wear.
    if (view_ == &people_ && people_.is_trying_on()) {
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
      case GLFW_KEY_F1: perform(Action::kHelp); break;
      case GLFW_KEY_F2: perform(Action::kSnapshot); break;
      case GLFW_KEY_F3: perform(Action::kClip); break;
      case GLFW_KEY_F4: perform(Action::kRecord); break;
      case GLFW_KEY_F5: perform(Action::kOtherView); break;
      case GLFW_KEY_F7: perform(Action::kPrediction); break;
      case GLFW_KEY_F6: ImGui::SetWindowFocus(ImGui::GetIO().NavActive ? nullptr : "panel"); break;
      case GLFW_KEY_F11: window_.toggle_full_screen(); break;
      case GLFW_KEY_ESCAPE: shows_help_ = false; break;
      default: perform(view_->press(key));
    }
  }
}

// By the arrows, and by the mouse where it was pressed.
void App::steer(float seconds, const Rect& area) {
  const ImGuiIO& io = ImGui::GetIO();
  Steering steering;
  steering.seconds = seconds;
  steering.is_dragging = !io.WantCaptureMouse && ImGui::IsMouseDown(ImGuiMouseButton_Left);
  steering.has_begun = steering.is_dragging && ImGui::IsMouseClicked(ImGuiMouseButton_Left);
  steering.pointer_x = io.MousePos.x;
  const ImVec2 drag = steering.is_dragging ? io.MouseDelta : ImVec2();
  steering.drag_x = drag.x;
  const float arrows = io.NavActive ? 0 : seconds * kArrowSpeed;
  steering.right = window_.held(GLFW_KEY_RIGHT, GLFW_KEY_LEFT) * arrows + drag.x * kDragSpeed;
  steering.down = window_.held(GLFW_KEY_DOWN, GLFW_KEY_UP) * arrows + drag.y * kDragSpeed;
  view_->steer(steering, area);
}

// Over the image: why there is none, what is being done, what was saved.
void App::draw_message(const Rect& area) {
  std::string text = view_->message();
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
    case Action::kOpenCamera: live_->open_camera(); break;
    case Action::kOtherView: view_ == &edges_ ? show(people_) : show(edges_); break;
    case Action::kPrediction: view_ == &prediction_ ? show(people_) : show(prediction_); break;
    case Action::kBack: show(*live_); break;
    case Action::kHead: show_head(false); break;
    case Action::kAddToHead: show_head(true); break;
    case Action::kExport: head_.export_head(saver_); break;
    case Action::kHelp: shows_help_ = !shows_help_; break;
    case Action::kSnapshot: saver_.save_snapshot(window_.read_pixels(view_->image_rect()), view_->companions()); break;
    case Action::kClip: saver_.has_clip() ? saver_.end_clip() : saver_.begin_clip(view_->images_per_second()); break;
    case Action::kRecord: live_->toggle_recording(saver_); break;
  }
}

void App::show(LiveView& view) {
  view_ = live_ = &view;
  scene_.open("");
  LiveView* const all[] = {&people_, &edges_, &prediction_};
  for (LiveView* const each : all) each->set_visible(each == &view);
  // People and prediction are views of one source.
  LiveView* const other = &view == &people_ ? all[2] : &view == &prediction_ ? all[0] : nullptr;
  if (other != nullptr && other->has_source()) {
    view.open(other->hand_over());
  } else if (!view.has_source()) {
    view.open_first();
  }
}

void App::show_head(bool adds_photo) {
  std::optional<maquette::LiveHeadPhoto> photo = people_.head_photo();
  if (!photo) return;
  people_.set_visible(false);
  view_ = &head_;
  head_.fit(std::move(*photo), adds_photo && head_.has_head());
}

void App::open(const std::string& path_or_uri) {
  std::error_code error;
  const fs::path extension = fs::path(path_or_uri).extension();
  const bool is_scene =
      fs::is_directory(path_or_uri, error) || extension == ".maqs" || extension == ".ply" || extension == ".spz";
  if (!is_scene) {
    live_->open(path_or_uri);
    return show(*live_);
  }
  view_ = &scene_;
  people_.set_visible(false);
  edges_.set_visible(false);
  prediction_.set_visible(false);
  scene_.open(path_or_uri);
}

void App::load_outfit(const std::string& path) {
  saver_.run([this, path] {
    maq_source_config config = maquette::default_source_config();
    config.max_side_px = kMaxOutfitPx;
    const auto frame = maquette::Source(context_, maquette::source_uri(path), &config).next();
    if (!frame) return path + " has no picture that could be worn.";
    outfits_.back().copy_from(*frame);
    outfits_.publish();
    Window::wake();
    return std::string();
  });
}

// Reports a run without a user, as one line of JSON. Returns the exit code.
int App::report(const maquette::RgbaImage& screenshot) {
  if (!options_.screenshot.empty() && !screenshot.empty()) screenshot.as_frame(context_).save(options_.screenshot);
  nlohmann::ordered_json json;
  people_.add_to_report(&json);
  if (view_ != &people_) view_->add_to_report(&json);
  const Rect all = window_.in_pixels(window_.rect());
  json["window_px"] = {all.width, all.height};
  json["opengl"] = window_.opengl();
  json["ui"] = {{"frames", times_.count()},
                {"longest_ms", times_.percentile_ms(100)},
                {"p99_ms", times_.percentile_ms(99)},
                {"start_ms", times_.start_ms()}};
  const std::string failure = view_->failure();
  std::puts(json.dump().c_str());
  if (!failure.empty()) std::fprintf(stderr, "maquette-demo: %s\n", failure.c_str());
  return failure.empty() ? 0 : 1;
}
