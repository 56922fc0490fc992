// People of a camera or a file, live: the source, the model, the views of them, and the body in the corner.
#pragma once

#include <app/live_densepose.h>
#include <app/triple_buffer.h>
#include <string>
#include <vector>

#include "mapped_frame.h"
#include "options.h"
#include "painter.h"
#include "stage_chart.h"
#include "window.h"

class PeopleView {
 public:
  PeopleView(const maquette::Context& context, const Window& window, Painter& painter, const Options& options);

  void open(const std::string& uri);
  bool has_source() const { return !live_.status().uri.empty(); }
  void set_visible(bool is_visible);  // it pauses while it is not
  void set_recording(const std::string& path) { live_.set_recording(path); }

  bool update();  // takes the newest result; true when there was one
  void press(int key);
  void steer(const Steering& steering);
  void draw(const Rect& area);
  Action draw_panel();

  View view() const { return view_; }
  const MappedFrame& frame() const { return frames_.front(); }
  maquette::LiveDensePoseStatus status() const { return live_.status(); }
  bool has_ended() const { return has_ended_; }  // with the result of the latest update()
  std::string message() const;                   // what the user must know
  Rect image_rect() const { return image_rect_; }
  Rect mesh_rect() const { return mesh_rect_; }  // empty where no body is drawn

 private:
  void apply_pause() { live_.set_paused(is_paused_ || !is_visible_); }
  void draw_boxes() const;
  void draw_views();
  void draw_model_options();

  const Window& window_;
  Painter& painter_;
  const std::string bundle_;
  maq_densepose_config model_;
  View view_;
  bool shows_mesh_, has_surface_ = false;
  bool is_paused_ = false, is_visible_ = true, seeks_camera_ = false, has_ended_ = false;
  float yaw_ = 0.5f, pitch_ = 0.15f;  // of the body
  Rect image_rect_, mesh_rect_;
  StageChart stages_;
  maquette::TripleBuffer<MappedFrame> frames_;
  std::vector<uint8_t> seen_;     // of the pipeline's thread
  maquette::LiveDensePose live_;  // last: its thread uses the others
};
