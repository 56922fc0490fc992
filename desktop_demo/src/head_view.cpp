#include "head_view.h"

#include <GLFW/glfw3.h>
#include <imgui.h>
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace {

constexpr int kMovingSide_px = 640, kStillSide_px = 1280;  // of images while the head is turned, and after
constexpr double kFirstYaw_rad = 0.45, kFirstPitch_rad = 0.1, kSteepest_rad = 1.5, kTurnAlone_rad = 0.02;
constexpr int kTurnsAlone = 20;  // images one way, then as many back

}  // namespace

HeadView::HeadView(const maquette::Context& context, const Options& options, const Window& window, Painter& painter)
    : MainView(options, window, painter),
      seconds_(float(options.fit_seconds)),
      live_(context, options.heads_bundle, options.model.model.threads, Window::wake) {
  wanted_.yaw_rad = kFirstYaw_rad, wanted_.pitch_rad = kFirstPitch_rad;
  wanted_.shading = options.shading;
  wanted_.is_over_photo = options.compare == Compare::kSlider;
}

void HeadView::fit(maquette::LiveHeadPhoto photo, bool adds_photo) {
  uploaded_photo_ = nullptr;
  first_of_ready_.reset();
  needs_image_ = true;
  live_.fit(std::move(photo), double(seconds_), adds_photo);
}

void HeadView::export_head(maquette::Saver& saver) const {
  saver.run([fitted = live_.fitted(), path = saver.new_path(".glb")] {
    if (fitted == nullptr) return std::string("There is no head to be exported yet.");
    fitted->mesh.save(path);
    const std::string kept = path.substr(0, path.rfind('.')) + ".maqh";
    fitted->head->save(kept);
    return "Saved " + path + " and " + kept;
  });
}

bool HeadView::update() {
  const bool has_new_photo = state()->photo != uploaded_photo_;
  const bool has_new_image = live_.images().take();
  if (has_new_image) ++image_count_;
  if (has_new_image || has_new_photo) upload();
  return has_new_image;
}

void HeadView::upload() {
  uploaded_photo_ = state()->photo;
  if (image_count_ > 0 && shows_slider()) return painter_.set_scene(image().rendering, image().photo);
  painter_.set_scene(image().rendering, uploaded_photo_ != nullptr ? *uploaded_photo_ : maquette::RgbaImage());
}

Action HeadView::press(int key) {
  if (key >= GLFW_KEY_1 && key <= GLFW_KEY_5) {
    wanted_.shading = maq_head_shading(key - GLFW_KEY_1);
    needs_image_ = true;
  }
  if (key == GLFW_KEY_C) wanted_.is_over_photo = !wanted_.is_over_photo, needs_image_ = true;
  if (key == GLFW_KEY_ESCAPE) live_.cancel();
  if (key == GLFW_KEY_E) return Action::kExport;
  return key == GLFW_KEY_X ? Action::kBack : Action::kNone;
}

// Photo and head beside each other, the head larger.
Rect HeadView::photo_rect(const Rect& area) const { return {area.x, area.y, area.width * 2 / 5, area.height}; }

Rect HeadView::head_rect(const Rect& area) const {
  if (wanted_.is_over_photo) return area;
  const int left = photo_rect(area).width;
  return {area.x + left, area.y, area.width - left, area.height};
}

void HeadView::steer(const Steering& steering, const Rect& area) {
  if (steering.has_begun) {
    const float x = float(image_rect_.x) + slider_ * float(image_rect_.width);
    drags_slider_ = shows_slider() && std::abs(steering.pointer_x - x) < 14 * window_.scale();
  }
  if (steering.is_dragging && drags_slider_) {
    slider_ = std::clamp(slider_ + steering.drag_x / float(std::max(1, image_rect_.width)), 0.0f, 1.0f);
    return;
  }
  const float wheel = ImGui::GetIO().WantCaptureMouse ? 0 : ImGui::GetIO().MouseWheel;
  const bool moves = steering.right != 0 || steering.down != 0 || wheel != 0;
  wanted_.yaw_rad -= double(steering.right);
  wanted_.pitch_rad = std::clamp(wanted_.pitch_rad + double(steering.down), -kSteepest_rad, kSteepest_rad);
  wanted_.zoom = std::clamp(wanted_.zoom * std::pow(1.1, double(wheel)), 0.5, 8.0);
  const bool resized = area.width != requested_area_.width || area.height != requested_area_.height;
  if (moves || is_moving_ || resized || needs_image_) request_image(moves, area);
  is_moving_ = moves;
  needs_image_ = false;
}

// In motion smaller images, for the sake of their number.
void HeadView::request_image(bool is_moving, const Rect& area) {
  requested_area_ = area;
  const Rect rect = head_rect(area);
  const double scale =
      std::min(1.0, double(is_moving ? kMovingSide_px : kStillSide_px) / std::max({rect.width, rect.height, 1}));
  wanted_.width_px = std::max(16, int(rect.width * scale)), wanted_.height_px = std::max(16, int(rect.height * scale));
  live_.render(wanted_);
}

void HeadView::draw(const Rect& area) {
  const auto head = state();
  if (!wanted_.is_over_photo && head->photo != nullptr && !shows_slider()) {
    const Rect rect = photo_rect(area).fit(head->photo->width_px, head->photo->height_px);
    painter_.draw_scene(rect, 1);
    if (!head->has_head) image_rect_ = rect;
  }
  if (image_count_ == 0) return;
  image_rect_ = (shows_slider() ? area : head_rect(area)).fit(image().rendering.width_px, image().rendering.height_px);
  painter_.draw_scene(image_rect_, shows_slider() ? slider_ : 0);
  if (!shows_slider()) return;
  const float x = float(image_rect_.x) + slider_ * float(image_rect_.width), top = float(image_rect_.y);
  ImGui::GetBackgroundDrawList()->AddLine({x, top}, {x, top + float(image_rect_.height)}, IM_COL32_WHITE,
                                          2 * window_.scale());
}

std::string HeadView::message() const {
  const auto head = state();
  if (head->phase != maquette::LiveHeadState::kFitting) return head->text;
  return head->text + " " + std::to_string(int(head->progress * 100)) + " %";
}

maquette::Saver::Companions HeadView::companions() const {
  const auto fitted = live_.fitted();
  if (fitted == nullptr) return nullptr;
  return [fitted](const std::string& path) {
    fitted->mesh.save(path + ".glb");
    return ".glb";
  };
}

bool HeadView::act_alone() {
  const auto head = state();
  if (head->phase == maquette::LiveHeadState::kFailed) return true;
  if (head->phase != maquette::LiveHeadState::kReady || image_count_ == acted_on_) return false;
  acted_on_ = image_count_;
  if (!first_of_ready_) first_of_ready_ = image_count_;
  const uint64_t turns = image_count_ - *first_of_ready_;
  if (turns + 1 >= options_.frames && turns > 0) return true;
  wanted_.yaw_rad += turns % (2 * kTurnsAlone) < kTurnsAlone ? kTurnAlone_rad : -kTurnAlone_rad;
  needs_image_ = true;
  return false;
}

std::string HeadView::failure() const {
  const auto head = state();
  return head->phase == maquette::LiveHeadState::kFailed ? head->text : "";
}

void HeadView::add_to_report(nlohmann::ordered_json* report) const {
  const auto head = state();
  nlohmann::ordered_json& json = *report;
  json["view"] = "head";
  json["frames"] = image_count_;
  json["picture_px"] = window_.in_pixels(image_rect_).numbers();
  json["problem"] = failure();
  json["head"] = {{"photos", head->photo_count},       {"used_photos", head->used_photo_count},
                  {"triangles", head->triangle_count}, {"pupil_distance_m", head->pupil_distance_m},
                  {"seconds", head->seconds},          {"rendering_ms", image().rendering_ms},
                  {"is_over_photo", shows_slider()},   {"shading", kShadingNames[size_t(wanted_.shading)]}};
}

Action HeadView::draw_panel() {
  const auto head = state();
  Action action = Action::kNone;
  if (head->phase == maquette::LiveHeadState::kFitting) {
    ImGui::ProgressBar(float(head->progress), {-1, 0});
    if (ImGui::Button("Cancel (Esc)")) live_.cancel();
  } else if (head->phase == maquette::LiveHeadState::kReady) {
    draw_facts();
  }
  ImGui::Separator();
  draw_choices();
  ImGui::SliderFloat("next fit", &seconds_, 0, 30, "%.0f s");
  if (has_head() && ImGui::Button("Export .glb and .maqh (E)")) action = Action::kExport;
  ImGui::TextWrapped(
      "Drag or use the arrows to turn the head, the wheel to zoom. A face is biometric data: ask the person. Nothing "
      "leaves this computer.");
  if (ImGui::Button("Back to people (X)")) action = Action::kBack;
  return action;
}

void HeadView::draw_facts() const {
  const auto head = state();
  ImGui::Text("%u of %u photos, %.1f s", head->used_photo_count, head->photo_count, head->seconds);
  ImGui::Text("%u triangles", head->triangle_count);
  if (head->pupil_distance_m > 0)
    ImGui::Text("pupils %.0f mm apart, as heads are on average", 1e3 * head->pupil_distance_m);
  if (image_count_ > 0) {
    ImGui::Text("%d x %d in %.1f ms", image().rendering.width_px, image().rendering.height_px, image().rendering_ms);
  }
}

void HeadView::draw_choices() {
  ImGui::TextUnformatted("Shading (1 to 5)");
  for (size_t i = 0; i < kShadingNames.size(); ++i) {
    if (i % 3 != 0) ImGui::SameLine(float(i % 3) * 100 * window_.scale());
    const auto shading = maq_head_shading(i);
    if (ImGui::RadioButton(kShadingNames[i], wanted_.shading == shading))
      wanted_.shading = shading, needs_image_ = true;
  }
  if (ImGui::Checkbox("over the photo (C)", &wanted_.is_over_photo)) needs_image_ = true;
  if (shows_slider()) ImGui::SliderFloat("photo", &slider_, 0, 1, "");
}
