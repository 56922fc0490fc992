// A scene, flown through, beside its photos.
#pragma once

#include <app/fly_camera.h>
#include <app/live_scene.h>
#include <memory>
#include <optional>
#include <string>

#include "options.h"
#include "painter.h"
#include "stage_chart.h"
#include "window.h"

class SceneView {
 public:
  SceneView(const maquette::Context& context, const Window& window, Painter& painter, const Options& options);

  void open(const std::string& path);
  void close();

  bool update();  // takes the newest image; true when there was one
  void press(int key);
  void steer(const Steering& steering, const Rect& area);
  void draw(const Rect& area);
  Action draw_panel();

  std::shared_ptr<const maquette::LiveSceneState> state() const { return live_.state(); }
  const maquette::LiveSceneImage& image() const { return live_.images().front(); }
  uint64_t image_count() const { return image_count_; }  // of the scene
  bool is_moving() const { return is_moving_ || needs_image_; }
  std::string message() const;  // what the user must know
  Rect image_rect() const { return image_rect_; }

  void rotate(double yaw);
  void fly_to_nearest_photo();

 private:
  void set_images();
  void set_compare(Compare compare);
  void fly_to_photo(int index);
  bool fly(const Steering& steering);  // true when it moved
  void request_image(bool is_flying, const Rect& area);
  float slider_x() const { return float(image_rect_.x) + slider_ * float(image_rect_.width); }
  void draw_slider() const;
  void draw_facts() const;
  void draw_photo_buttons();

  const Window& window_;
  Painter& painter_;
  const std::string capture_;
  const double to_photo_s_;
  Compare compare_;
  std::optional<maquette::FlyCamera> camera_;
  bool is_moving_ = false;    // it flies
  bool needs_image_ = false;  // of what was not the user's steering
  bool drags_slider_ = false;
  float slider_ = 0.5f;
  int photo_ = 0;  // where the camera was last or flies to
  Rect image_rect_, requested_area_;
  uint64_t image_count_ = 0;
  StageChart stages_;
  maquette::LiveScene live_;
};
