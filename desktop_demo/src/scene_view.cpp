#include "scene_view.h"

#include <GLFW/glfw3.h>
#include <imgui.h>
#include <algorithm>
#include <cmath>
#include <iterator>

namespace {

constexpr int kMovingSidePx = 640, kStillSidePx = 1280;  // of images while flying, and after
constexpr double kFlightSpeed = 0.12;                    // diagonals of the scene a second
constexpr double kToPhotoS = 0.6;
constexpr const char* kSceneStages[] = {"project", "shade", "refine", "resample"};

}  // namespace

SceneView::SceneView(const maquette::Context& context, const Options& options, const Window& window, Painter& painter)
    : MainView(options, window, painter),
      compare_(options.compare),
      live_(context, options.scene_bundle, options.model.model.threads, Window::wake) {
  painter_.draw_scene({0, 0, 8, 8}, 0);  // software OpenGL compiles a shader when it draws with it first
}

void SceneView::open(const std::string& path) {
  camera_.reset();
  image_count_ = acted_on_ = 0;
  stages_.clear();
  live_.open(path, options_.capture);
}

bool SceneView::update() {
  if (!live_.images().take()) return false;
  ++image_count_;
  set_images();
  const maq_scene_render_stats& s = image().stats;
  stages_.add({s.project_ms, s.shade_ms, s.refine_ms, s.resample_ms});
  return true;
}

void SceneView::set_images() {
  if (image_count_ == 0) return;
  painter_.set_scene(image().rendering, compare_ == Compare::kError ? image().error : image().photo);
}

Action SceneView::press(int key) {
  if (key == GLFW_KEY_C) set_compare(Compare((int(compare_) + 1) % 3));
  if (key == GLFW_KEY_N) fly_to_nearest_photo();
  if (key == GLFW_KEY_COMMA) fly_to_photo(photo_ - 1);
  if (key == GLFW_KEY_PERIOD) fly_to_photo(photo_ + 1);
  return key == GLFW_KEY_X ? Action::kBack : Action::kNone;
}

void SceneView::set_compare(Compare compare) {
  compare_ = compare;
  if (compare != Compare::kNone && camera_ && camera_->photo_index() < 0) fly_to_nearest_photo();
  set_images();
}

void SceneView::fly_to_nearest_photo() {
  if (camera_) fly_to_photo(camera_->nearest_photo(state()->photos));
}

void SceneView::fly_to_photo(int index) {
  const auto scene = state();
  const int count = int(scene->photos.size());
  if (!camera_ || count == 0) return;
  photo_ = (index + count) % count;
  camera_->fly_to(scene->photos[size_t(photo_)], options_.headless ? 0 : kToPhotoS, photo_);
  needs_image_ = true;
}

void SceneView::steer(const Steering& steering, const Rect& area) {
  if (steering.has_begun) {
    drags_slider_ = compare_ == Compare::kSlider && std::abs(steering.pointer_x - slider_x()) < 14 * window_.scale();
  }
  if (steering.is_dragging && drags_slider_) {
    slider_ = std::clamp(slider_ + steering.drag_x / float(std::max(1, image_rect_.width)), 0.0f, 1.0f);
    return;
  }
  const auto scene = state();
  if (scene->phase != maquette::LiveSceneState::kReady) return;
  const bool is_new = !camera_;
  if (is_new) camera_.emplace(scene->info, scene->photos);
  const bool moves = fly(steering) || is_new;
  const bool resized = area.width != requested_area_.width || area.height != requested_area_.height;
  const bool needs_image = moves || is_moving_ || resized || needs_image_;
  is_moving_ = moves;
  needs_image_ = false;
  if (needs_image) request_image(moves, area);
}

bool SceneView::fly(const Steering& steering) {
  const double right = double(window_.held(GLFW_KEY_D, GLFW_KEY_A)), up = double(window_.held(GLFW_KEY_E, GLFW_KEY_Q));
  const double forward = double(window_.held(GLFW_KEY_W, GLFW_KEY_S)), seconds = double(steering.seconds);
  const float wheel = ImGui::GetIO().WantCaptureMouse ? 0 : ImGui::GetIO().MouseWheel;
  const bool is_steered =
      steering.right != 0 || steering.down != 0 || right != 0 || up != 0 || forward != 0 || wheel != 0;
  if (is_steered) {
    camera_->rotate(double(steering.right), double(-steering.down));
    camera_->zoom(std::pow(1.1, double(wheel)));
    camera_->move(right, up, forward, seconds, kFlightSpeed);
  }
  return camera_->update(seconds) || is_steered;
}

void SceneView::request_image(bool is_flying, const Rect& area) {
  requested_area_ = area;
  const int photo = camera_->photo_index();
  if (photo >= 0) {
    photo_ = photo;
    return live_.render(*camera_->photo_camera(), photo);
  }
  // In motion smaller images, for the sake of their number.
  const int side_px = std::max(area.width, area.height);
  const double scale = std::min(1.0, double(is_flying ? kMovingSidePx : kStillSidePx) / side_px);
  const auto scaled = [&](int px) { return std::max(16, int(px * scale)); };
  live_.render(camera_->camera(scaled(area.width), scaled(area.height)), -1);
}

void SceneView::draw(const Rect& area) {
  if (image_count_ == 0) return;
  image_rect_ = area.fit(image().rendering.width_px, image().rendering.height_px);
  const bool compares = compare_ != Compare::kNone && image().photo_index >= 0;
  painter_.draw_scene(image_rect_, !compares ? 0 : compare_ == Compare::kError ? 1 : slider_);
  if (compares && compare_ == Compare::kSlider) draw_slider();
}

void SceneView::draw_slider() const {
  ImDrawList* const list = ImGui::GetBackgroundDrawList();
  const float x = slider_x(), top = float(image_rect_.y);
  const ImVec2 photo = ImGui::CalcTextSize("photo");
  list->AddLine({x, top}, {x, top + float(image_rect_.height)}, IM_COL32_WHITE, 2 * window_.scale());
  list->AddRectFilled({x - photo.x - 14, top}, {x + ImGui::CalcTextSize("rendering").x + 14, top + photo.y + 6},
                      IM_COL32(0, 0, 0, 150));
  list->AddText({x - photo.x - 8, top + 3}, IM_COL32_WHITE, "photo");
  list->AddText({x + 8, top + 3}, IM_COL32_WHITE, "rendering");
}

bool SceneView::act_alone() {
  if (!failure().empty()) return true;
  if (image_count_ == acted_on_) return false;
  acted_on_ = image_count_;
  if (image_count_ + 1 < options_.frames) {
    camera_->rotate(image_count_ % 40 < 20 ? 0.02 : -0.02, 0);
    needs_image_ = true;
  } else if (image().photo_index >= 0 || state()->photos.empty()) {
    return true;
  } else {
    fly_to_nearest_photo();
  }
  return false;
}

std::string SceneView::failure() const {
  const auto scene = state();
  return scene->phase == maquette::LiveSceneState::kFailed ? scene->text : "";
}

void SceneView::add_to_report(nlohmann::ordered_json* report) const {
  const auto scene = state();
  nlohmann::ordered_json& json = *report;
  json["frames"] = image_count_;
  json["picture_px"] = window_.in_pixels(image_rect_).numbers();
  json["problem"] = failure();
  json["scene"] = {{"points", scene->info.point_count}, {"photo", nullptr}, {"psnr_db", nullptr}};
  if (image_count_ == 0 || image().photo_index < 0) return;
  json["scene"]["photo"] = scene->photo_names[size_t(image().photo_index)];
  json["scene"]["psnr_db"] = image().psnr_db;
}

std::string SceneView::message() const {
  const auto scene = state();
  if (scene->phase == maquette::LiveSceneState::kReady) return "";
  if (scene->phase != maquette::LiveSceneState::kOpening) return scene->text;
  return scene->text + " " + std::to_string(int(scene->progress * 100)) + " %";
}

Action SceneView::draw_panel() {
  const auto scene = state();
  ImGui::TextWrapped("%s", scene->path.c_str());
  if (scene->phase == maquette::LiveSceneState::kOpening) {
    ImGui::ProgressBar(float(scene->progress), {-1, 0}, scene->text.c_str());
  }
  // Until its first image is there the one that is shown may be of another scene.
  if (scene->phase == maquette::LiveSceneState::kReady && image_count_ > 0) draw_facts();
  stages_.draw(kSceneStages, std::size(kSceneStages), window_.scale());
  if (!scene->photos.empty()) draw_photo_buttons();
  ImGui::TextWrapped("Fly: W A S D, Q E down and up, mouse or arrows to look, wheel to zoom.");
  return ImGui::Button("Back to people (X)") ? Action::kBack : Action::kNone;
}

void SceneView::draw_facts() const {
  const auto scene = state();
  ImGui::Text("%llu points, %zu photos", static_cast<unsigned long long>(scene->info.point_count),
              scene->photos.size());
  ImGui::Text("%d x %d in %.1f ms, %llu points visible", image().rendering.width_px, image().rendering.height_px,
              double(image().stats.total_ms), static_cast<unsigned long long>(image().stats.shaded_point_count));
  if (image().photo_index >= 0) {
    ImGui::TextWrapped("%s: PSNR %.1f dB", scene->photo_names[size_t(image().photo_index)].c_str(), image().psnr_db);
  } else {
    ImGui::TextUnformatted("");
  }
  if (!scene->text.empty()) ImGui::TextWrapped("%s", scene->text.c_str());
}

void SceneView::draw_photo_buttons() {
  ImGui::TextUnformatted("Photo against rendering (C)");
  for (size_t which = 0; which < kCompareNames.size(); ++which) {
    if (which != 0) ImGui::SameLine();
    if (ImGui::RadioButton(kCompareNames[which], compare_ == Compare(which))) set_compare(Compare(which));
  }
  if (compare_ == Compare::kSlider) ImGui::SliderFloat("photo", &slider_, 0, 1, "");
  if (ImGui::Button("Nearest photo (N)")) fly_to_nearest_photo();
  ImGui::SameLine();
  if (ImGui::Button("<")) fly_to_photo(photo_ - 1);
  ImGui::SameLine();
  if (ImGui::Button(">")) fly_to_photo(photo_ + 1);
}
