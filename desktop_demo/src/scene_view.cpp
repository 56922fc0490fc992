// The scene part of the demo: flying, photos beside the rendering, its panel.
#include <GLFW/glfw3.h>
#include <imgui.h>
#include <algorithm>
#include <cmath>

#include "app.h"

namespace {

constexpr int kMovingSidePx = 640, kStillSidePx = 1280;  // of pictures while flying, and after
constexpr double kFlightSpeed = 0.12;                    // diagonals of the scene a second
constexpr double kToPhotoS = 0.6;
constexpr const char* kCompareNames[] = {"off", "slider", "error"};
constexpr const char* kStages[] = {"project", "shade", "refine", "turn"};

}  // namespace

void App::set_scene_pictures() {
  const maquette::LiveScenePicture& shown = scenes_.shown().front();
  if (pictures_ > 0)
    painter_.set_scene(shown.rendering, options_.compare == Compare::kError ? shown.error : shown.photo);
}

void App::set_compare(Compare compare) {
  options_.compare = compare;
  const auto state = scenes_.state();
  if (compare != Compare::kNone && flight_ && flight_->at_photo() < 0) {
    go_to_photo(flight_->nearest_photo(state->photos));
  }
  set_scene_pictures();
}

void App::go_to_photo(int index) {
  const auto state = scenes_.state();
  const int count = int(state->photos.size());
  if (!flight_ || count == 0) return;
  photo_ = (index + count) % count;
  flight_->go_to(state->photos[size_t(photo_)], options_.headless ? 0 : kToPhotoS, photo_);
  turned_ = true;
}

void App::fly(float look_right, float look_down, float seconds) {
  const auto state = scenes_.state();
  if (state->what != maquette::LiveSceneState::kReady) return;
  bool moves = !flight_;
  if (!flight_) flight_.emplace(state->info, state->photos);
  const float right = window_.held(GLFW_KEY_D, GLFW_KEY_A), up = window_.held(GLFW_KEY_E, GLFW_KEY_Q);
  const float forward = window_.held(GLFW_KEY_W, GLFW_KEY_S);
  const float wheel = ImGui::GetIO().WantCaptureMouse ? 0 : ImGui::GetIO().MouseWheel;
  if (look_right != 0 || look_down != 0 || right != 0 || up != 0 || forward != 0 || wheel != 0) {
    flight_->turn(double(look_right), double(-look_down));
    flight_->zoom(std::pow(1.1, double(wheel)));
    flight_->move(double(right), double(up), double(forward), double(seconds), kFlightSpeed);
    moves = true;
  }
  moves |= flight_->update(double(seconds));
  const bool resized = picture_area_.width != looked_at_.width || picture_area_.height != looked_at_.height;
  const bool looks = moves || moving_ || resized || turned_;
  moving_ = moves;
  turned_ = false;
  if (!looks) return;
  looked_at_ = picture_area_;
  const int photo = flight_->at_photo();
  if (photo >= 0) {
    photo_ = photo;
    scenes_.look(state->photos[size_t(photo)], photo);
    return;
  }
  // In motion smaller pictures, for the sake of their number.
  const int side_px = std::max(picture_area_.width, picture_area_.height);
  const double scale = std::min(1.0, double(moves ? kMovingSidePx : kStillSidePx) / side_px);
  const auto scaled = [&](int px) { return std::max(16, int(px * scale)); };
  scenes_.look(flight_->camera(scaled(picture_area_.width), scaled(picture_area_.height)), -1);
}

float App::slider_x() const { return float(picture_rect_.x) + slider_ * float(picture_rect_.width); }

void App::draw_slider() {
  ImDrawList* const list = ImGui::GetBackgroundDrawList();
  const float x = slider_x(), top = float(picture_rect_.y);
  const ImVec2 photo = ImGui::CalcTextSize("photo");
  list->AddLine({x, top}, {x, top + float(picture_rect_.height)}, IM_COL32_WHITE, 2 * window_.scale());
  list->AddRectFilled({x - photo.x - 14, top}, {x + ImGui::CalcTextSize("rendering").x + 14, top + photo.y + 6},
                      IM_COL32(0, 0, 0, 150));
  list->AddText({x - photo.x - 8, top + 3}, IM_COL32_WHITE, "photo");
  list->AddText({x + 8, top + 3}, IM_COL32_WHITE, "rendering");
}

void App::draw_scene_panel() {
  const auto state = scenes_.state();
  const maquette::LiveScenePicture& shown = scenes_.shown().front();
  ImGui::TextWrapped("%s", state->path.c_str());
  if (state->what == maquette::LiveSceneState::kOpening)
    ImGui::ProgressBar(float(state->done), {-1, 0}, state->text.c_str());
  // Until its first picture is there the one that is shown may be of another scene.
  if (state->what == maquette::LiveSceneState::kReady && pictures_ > 0) {
    ImGui::Text("%llu points, %zu photos", static_cast<unsigned long long>(state->info.point_count),
                state->photos.size());
    ImGui::Text("%d x %d in %.1f ms, %llu points seen", shown.rendering.width_px, shown.rendering.height_px,
                double(shown.stats.total_ms), static_cast<unsigned long long>(shown.stats.shaded_point_count));
    if (shown.photo_index >= 0) {
      ImGui::TextWrapped("%s: PSNR %.1f dB", state->photo_names[size_t(shown.photo_index)].c_str(), shown.psnr_db);
    } else {
      ImGui::TextUnformatted("");
    }
    if (!state->text.empty()) ImGui::TextWrapped("%s", state->text.c_str());
  }
  draw_stages(kStages, std::size(kStages));
  if (!state->photos.empty()) {
    ImGui::TextUnformatted("Photo against rendering (C)");
    for (size_t which = 0; which < std::size(kCompareNames); ++which) {
      if (which != 0) ImGui::SameLine();
      if (ImGui::RadioButton(kCompareNames[which], options_.compare == Compare(which))) set_compare(Compare(which));
    }
    if (options_.compare == Compare::kSlider) ImGui::SliderFloat("photo", &slider_, 0, 1, "");
    if (ImGui::Button("Nearest photo (N)") && flight_) go_to_photo(flight_->nearest_photo(state->photos));
    ImGui::SameLine();
    if (ImGui::Button("<")) go_to_photo(photo_ - 1);
    ImGui::SameLine();
    if (ImGui::Button(">")) go_to_photo(photo_ + 1);
  }
  ImGui::TextWrapped("Fly: W A S D, Q E down and up, mouse or arrows to look, wheel to zoom.");
  if (ImGui::Button("Back to people (X)")) open_people();
}
