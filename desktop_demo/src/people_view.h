// People of a camera or a file, live: the source, the model, the views of them, and the body in the corner.
#pragma once

#include <app/live_densepose.h>
#include <app/mapped_frame.h>
#include <app/saver.h>
#include <app/triple_buffer.h>
#include <string>
#include <vector>

#include "main_view.h"

class PeopleView final : public MainView {
 public:
  PeopleView(const maquette::Context& context, const Options& options, const Window& window, Painter& painter);

  void open(const std::string& uri);
  bool has_source() const { return !live_.status().uri.empty(); }
  void set_visible(bool is_visible);              // it pauses while it is not
  void toggle_recording(maquette::Saver& saver);  // of the source, into the saver's folder
  bool is_trying_on() const { return view_ == View::kTryOn; }

  bool update() override;
  Action press(int key) override;
  void steer(const Steering& steering, const Rect& area) override;
  void draw(const Rect& area) override;
  Action draw_panel() override;

  std::string message() const override;
  double images_per_second() const override { return std::max(1.0, frame().results_per_second); }
  std::shared_ptr<const maquette::DensePoseResult> result() const override { return frame().result; }

  bool act_alone() override { return has_ended_; }
  std::string failure() const override;
  void add_to_report(nlohmann::ordered_json* report) const override;

 private:
  const maquette::MappedFrame& frame() const { return frames_.front(); }
  void apply_pause() { live_.set_paused(is_paused_ || !is_visible_); }
  void draw_boxes() const;
  void draw_views();
  void draw_model_options();

  maq_densepose_config model_;
  View view_;
  bool shows_mesh_, has_surface_ = false;
  bool is_paused_ = false, is_visible_ = true, seeks_camera_ = false;
  bool has_ended_ = false;            // with the result of the latest update()
  std::string recording_;             // its path; "" without one
  float yaw_ = 0.5f, pitch_ = 0.15f;  // of the body
  Rect mesh_rect_;                    // empty where no body is drawn
  maquette::TripleBuffer<maquette::MappedFrame> frames_;
  std::vector<uint8_t> seen_;     // of the pipeline's thread
  maquette::LiveDensePose live_;  // last: its thread uses the others
};
