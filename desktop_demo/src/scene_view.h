// A scene, flown through, beside its photos.
#pragma once

#include <app/fly_camera.h>
#include <app/live_scene.h>
#include <memory>
#include <optional>
#include <string>

#include "main_view.h"

class SceneView final : public MainView {
 public:
  SceneView(const maquette::Context& context, const Options& options, const Window& window, Painter& painter);

  void open(const std::string& path);  // "" closes the scene

  bool update() override;
  Action press(int key) override;
  void steer(const Steering& steering, const Rect& area) override;
  void draw(const Rect& area) override;
  Action draw_panel() override;

  bool is_moving() const override { return is_moving_ || needs_image_; }
  std::string message() const override;
  double images_per_second() const override { return 25; }

  bool act_alone() override;  // looks around, and ends where a photo was taken
  std::string failure() const override;
  void add_to_report(nlohmann::ordered_json* report) const override;

 private:
  std::shared_ptr<const maquette::LiveSceneState> state() const { return live_.state(); }
  const maquette::LiveSceneImage& image() const { return live_.images().front(); }
  void set_images();
  void set_compare(Compare compare);
  void fly_to_photo(int index);
  void fly_to_nearest_photo();
  bool fly(const Steering& steering);  // true when it moved
  void request_image(bool is_flying, const Rect& area);
  float slider_x() const { return float(image_rect_.x) + slider_ * float(image_rect_.width); }
  void draw_slider() const;
  void draw_facts() const;
  void draw_photo_buttons();

  Compare compare_;
  std::optional<maquette::FlyCamera> camera_;
  bool is_moving_ = false;    // it flies
  bool needs_image_ = false;  // of movements other than the user's steering
  bool drags_slider_ = false;
  float slider_ = 0.5f;
  int photo_ = 0;  // where the camera was last or flies to
  Rect requested_area_;
  uint64_t image_count_ = 0, acted_on_ = 0;  // images of the scene, and which of them act_alone() saw
  maquette::LiveScene live_;
};
