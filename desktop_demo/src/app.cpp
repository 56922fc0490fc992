#include "app.h"

#include <GLFW/glfw3.h>
#include <imgui.h>
#include <algorithm>
#include <cstdio>
#include <filesystem>

namespace fs = std::filesystem;

namespace {

constexpr char kRenderedPeople[] = "stub:people?count=2";
constexpr int kLargestOutfitPx = 4096;
// Between two turns, when the picture moves and when nothing happens.
constexpr double kFlightTurnS = 0.016, kIdleS = 0.25;

// A path as a URI of the library, which says what is wrong with it.
std::string uri_of(const std::string& path_or_uri) {
  std::error_code error;
  if (!fs::exists(path_or_uri, error) && path_or_uri.find(':') != std::string::npos) return path_or_uri;
  std::string uri = "file:";
  for (const char c : path_or_uri) uri += c == '?' ? "%3F" : c == '%' ? "%25" : std::string(1, c);
  return uri;
}

maquette::LiveOptions live_options(const Options& options) {
  maquette::LiveOptions live;
  live.in_real_time = !options.headless;
  live.most_frames = options.frames;
  if (options.headless) live.reconnect_ms = 4000;
  return live;
}

}  // namespace

App::App(const Options& options)
    : options_(options),
      start_s_(maquette::monotonic_s()),
      window_("Maquette", options.width_px, options.height_px, !options.headless),
      painter_(window_),
      people_(
          context_, options.model,
          [this](const maquette::LiveFrame& mapped) {
            mapped_.back().take_over(mapped, &seen_);
            mapped_.publish();
            Window::wake();
          },
          Window::wake, live_options(options)),
      scenes_(context_, options.scene_bundle, options.model.threads, Window::wake) {
  if (!options.texture.empty()) load_outfit(options.texture);
  // Software OpenGL compiles a shader when it draws with it first: now, before anybody waits.
  for (const View view : {View::kCamera, View::kParts}) painter_.draw_people(view, {0, 0, 8, 8});
  painter_.draw_scene({0, 0, 8, 8}, 0);
  painter_.draw_body({0, 0, 8, 8}, 0, 0);
  open(options.source);
}

int App::run() {
  maquette::Picture last;
  double before_s = maquette::monotonic_s();
  while (!window_.is_closing()) {
    window_.wait(shows_scene_ && (moving_ || turned_) ? kFlightTurnS : kIdleS);
    const double turn_s = maquette::monotonic_s();
    take_news();
    take_keys();
    steer(float(std::min(0.1, turn_s - before_s)));
    before_s = turn_s;
    window_.begin_drawing();
    draw();
    window_.end_drawing();
    if (clip_file_ && fresh_) add_to_clip();
    const bool done = options_.headless && is_done();
    if (done) last = window_.read_pixels(window_.rect());
    window_.show();
    if (start_ms_ == 0) {
      start_ms_ = (maquette::monotonic_s() - start_s_) * 1000;
    } else if (options_.headless) {
      turns_ms_.push_back(float((maquette::monotonic_s() - turn_s) * 1000));
    }
    if (done) window_.close();
  }
  if (clip_file_ != nullptr) toggle_clip();
  window_.hide();  // before it waits for the threads
  if (!options_.headless) return 0;
  if (!options_.screenshot.empty() && !last.empty()) last.frame(context_).save(options_.screenshot);
  std::puts(report().c_str());
  const std::string problem = shows_scene_ ? scenes_.state()->text : people_.status().problem;
  if (!has_failed()) return 0;
  std::fprintf(stderr, "maquette-demo: %s\n", problem.c_str());
  return 1;
}

void App::open(const std::string& path_or_uri) {
  std::error_code error;
  shows_scene_ = fs::is_directory(path_or_uri, error) || fs::path(path_or_uri).extension() == ".maqs";
  stages_.clear();
  people_.pause(shows_scene_ || paused_);
  if (shows_scene_) {
    flight_.reset();
    pictures_ = 0;
    scenes_.open(path_or_uri, options_.capture);
  } else {
    scenes_.close();
    recording_.clear();  // it ends with its source
    seeks_camera_ = path_or_uri == kFirstCamera;
    people_.open(uri_of(path_or_uri), seeks_camera_ ? kRenderedPeople : "");
  }
}

void App::open_people() {
  shows_scene_ = false;
  scenes_.close();
  stages_.clear();
  if (people_.status().uri.empty()) open(kFirstCamera);
  people_.pause(paused_);
}

void App::load_outfit(const std::string& path) {
  files_.add([this, path] {
    const auto frame = maquette::Source(context_, uri_of(path)).next();
    if (!frame || std::max(frame->desc().width_px, frame->desc().height_px) > kLargestOutfitPx) {
      return path + " cannot be worn: its sides must be up to " + std::to_string(kLargestOutfitPx) + " pixels.";
    }
    outfits_.back().take(*frame);
    outfits_.publish();
    Window::wake();
    return std::string();
  });
}

void App::take_news() {
  for (const std::string& path : window_.take_drops()) {
    // In the try-on view what is dropped is something to wear.
    if (options_.view == View::kTryOn && !shows_scene_) {
      load_outfit(path);
    } else {
      open(path);
    }
  }
  if (outfits_.take()) painter_.set_outfit(outfits_.front());
  int nodes = 0;
  if (!has_surface_) {
    const std::vector<float> points = people_.surface(&nodes);
    if (nodes > 0) painter_.set_body(maquette::BodyMesh(points, nodes));
    has_surface_ = nodes > 0;
  }
  fresh_ = false;
  ended_ = people_.status().ended;  // asked before the frame is taken, which then is the last
  if (mapped_.take()) {
    fresh_ = true;
    const MappedFrame& frame = mapped_.front();
    painter_.set_frame(frame);
    const maq_densepose_stats& s = frame.stats;
    stages_.push_back({{s.trunk_ms, s.proposals_ms, s.box_head_ms, s.dense_head_ms, s.decode_ms, s.preprocess_ms,
                        float(frame.copying_ms), float(frame.waiting_ms)}});
  }
  if (scenes_.shown().take()) {
    fresh_ = true;
    ++pictures_;
    set_scene_pictures();
    const maq_scene_image_stats& s = scenes_.shown().front().stats;
    stages_.push_back({{s.project_ms, s.shade_ms, s.refine_ms, s.resample_ms}});
  }
  while (stages_.size() > 200) stages_.pop_front();
}

void App::take_keys() {
  for (const int key : window_.take_keys()) {
    if (ImGui::GetIO().WantTextInput) continue;
    if (key >= GLFW_KEY_1 && key <= GLFW_KEY_6) options_.view = View(key - GLFW_KEY_1);
    if (key == GLFW_KEY_M) options_.mesh = !options_.mesh;
    if (key == GLFW_KEY_H) options_.panel = !options_.panel;
    if (key == GLFW_KEY_P) people_.pause((paused_ = !paused_) || shows_scene_);
    if (key == GLFW_KEY_C && shows_scene_) set_compare(Compare((int(options_.compare) + 1) % 3));
    if (key == GLFW_KEY_N && flight_) go_to_photo(flight_->nearest_photo(scenes_.state()->photos));
    if (key == GLFW_KEY_COMMA) go_to_photo(photo_ - 1);
    if (key == GLFW_KEY_PERIOD) go_to_photo(photo_ + 1);
    if (key == GLFW_KEY_X && shows_scene_) open_people();
    if (key == GLFW_KEY_F6) ImGui::SetWindowFocus(ImGui::GetIO().NavActive ? nullptr : "panel");
    if (key == GLFW_KEY_F1) help_ = !help_;
    if (key == GLFW_KEY_F2) take_snapshot();
    if (key == GLFW_KEY_F3) toggle_clip();
    if (key == GLFW_KEY_F4) toggle_recording();
    if (key == GLFW_KEY_F11) window_.toggle_full_screen();
    if (key == GLFW_KEY_ESCAPE) help_ = false;
  }
}

// Arrows, and the mouse where it was pressed: turns the body, moves the slider, or flies.
void App::steer(float seconds) {
  const ImGuiIO& io = ImGui::GetIO();
  const bool mouse = !io.WantCaptureMouse && ImGui::IsMouseDown(ImGuiMouseButton_Left);
  if (mouse && ImGui::IsMouseClicked(ImGuiMouseButton_Left)) {
    drags_slider_ = shows_scene_ && options_.compare == Compare::kSlider &&
                    std::abs(io.MousePos.x - slider_x()) < 14 * window_.scale();
  }
  const float dx = mouse ? io.MouseDelta.x : 0, dy = mouse ? io.MouseDelta.y : 0;
  if (mouse && drags_slider_) {
    slider_ = std::clamp(slider_ + dx / float(std::max(1, picture_rect_.width)), 0.0f, 1.0f);
    return;
  }
  const float arrows = io.NavActive ? 0 : seconds * 1.5f;
  const float right = window_.held(GLFW_KEY_RIGHT, GLFW_KEY_LEFT) * arrows + dx * 0.005f;
  const float down = window_.held(GLFW_KEY_DOWN, GLFW_KEY_UP) * arrows + dy * 0.005f;
  if (shows_scene_) return fly(right, down, seconds);
  yaw_ -= right;
  pitch_ = std::clamp(pitch_ + down, -1.5f, 1.5f);
}

void App::draw() {
  const Rect all = window_.rect();
  const int panel_px = options_.panel ? std::min(int(330 * window_.scale()), all.width / 2) : 0;
  picture_area_ = {0, 0, std::max(1, all.width - panel_px), all.height};
  body_rect_ = {};
  if (shows_scene_) {
    const maquette::LiveScenePicture& shown = scenes_.shown().front();
    if (pictures_ > 0) {
      picture_rect_ = picture_area_.fit(shown.rendering.width_px, shown.rendering.height_px);
      const bool compares = options_.compare != Compare::kNone && shown.photo_index >= 0;
      painter_.draw_scene(picture_rect_, !compares ? 0 : options_.compare == Compare::kError ? 1 : slider_);
      if (compares && options_.compare == Compare::kSlider) draw_slider();
    }
  } else if (mapped_.front().number > 0) {
    const MappedFrame& frame = mapped_.front();
    picture_rect_ = picture_area_.fit(frame.camera.width_px, frame.camera.height_px);
    painter_.draw_people(options_.view, picture_rect_);
    if (options_.view == View::kBoxes) draw_boxes(frame);
    if (options_.mesh) {
      const int side = std::min(picture_area_.width, picture_area_.height) * 3 / 10;
      body_rect_ = {0, all.height - side, side, side};
      painter_.draw_body(body_rect_, yaw_, pitch_);
    }
  }
  draw_news();
  if (options_.panel) draw_panel(panel_px);
  if (help_) draw_help();
}

void App::draw_boxes(const MappedFrame& frame) {
  ImDrawList* const list = ImGui::GetBackgroundDrawList();
  const float scale = float(picture_rect_.width) / float(frame.camera.width_px);
  const auto place = [&](float x, float y) {
    return ImVec2(float(picture_rect_.x) + x * scale, float(picture_rect_.y) + y * scale);
  };
  for (const maq_person& person : frame.people) {
    const ImVec2 from = place(person.box_px[0], person.box_px[1]), to = place(person.box_px[2], person.box_px[3]);
    list->AddRect(from, to, IM_COL32(255, 255, 255, 255), 0, 0, 2 * window_.scale());
    char score[8];
    std::snprintf(score, sizeof score, "%.2f", double(person.score));
    const ImVec2 size = ImGui::CalcTextSize(score);
    const float top = std::max(float(picture_rect_.y), from.y - size.y - 4);
    list->AddRectFilled({from.x, top}, {from.x + size.x + 8, top + size.y + 4}, IM_COL32(255, 255, 255, 255));
    list->AddText({from.x + 4, top + 2}, IM_COL32(24, 26, 40, 255), score);
  }
}

// What the person must know, over the picture: why there are no frames, what is being done, what was saved.
void App::draw_news() {
  std::string text;
  if (shows_scene_) {
    const auto state = scenes_.state();
    if (state->what != maquette::LiveSceneState::kReady) text = state->text;
    if (state->what == maquette::LiveSceneState::kOpening) text += " " + std::to_string(int(state->done * 100)) + " %";
  } else {
    const maquette::LiveStatus status = people_.status();
    text = status.problem.empty() ? status.doing : status.problem;
    if (seeks_camera_ && status.uri.rfind(kRenderedPeople, 0) == 0 && !text.empty()) {
      text += " These people are rendered; drop a photo, a clip or a recording here.";
    }
  }
  const std::string told = files_.told();
  if (told != told_) told_ = told, told_at_s_ = maquette::monotonic_s();
  if (maquette::monotonic_s() - told_at_s_ < 5) text += (text.empty() ? "" : "\n") + told_;
  if (text.empty()) return;
  const float margin = 10 * window_.scale(), width = float(picture_area_.width) - 4 * margin;
  const ImVec2 size = ImGui::CalcTextSize(text.c_str(), nullptr, false, width);
  ImDrawList* const list = ImGui::GetBackgroundDrawList();
  list->AddRectFilled({margin, margin}, {size.x + 3 * margin, size.y + 3 * margin}, IM_COL32(20, 20, 24, 220),
                      margin / 2);
  list->AddText(ImGui::GetFont(), ImGui::GetFontSize(), {2 * margin, 2 * margin}, IM_COL32(255, 214, 120, 255),
                text.c_str(), nullptr, width);
}
