// People of a camera or a file, live: the model, the views of them, and the body in the corner.
#pragma once

#include <app/live_densepose.h>
#include <app/live_head.h>
#include <app/mapped_frame.h>
#include <app/triple_buffer.h>
#include <atomic>
#include <optional>
#include <vector>

#include "live_view.h"

class PeopleView final : public LiveView {
 public:
  PeopleView(const maquette::Context& context, const Options& options, const Window& window, Painter& painter);

  bool is_trying_on() const { return view_ == View::kTryOn; }

  // The current image with the largest head; nothing before the first image.
  std::optional<maquette::LiveHeadPhoto> head_photo() const { return maquette::head_photo_of(frame()); }

  bool update() override;
  Action press(int key) override;
  void steer(const Steering& steering, const Rect& area) override;
  void draw(const Rect& area) override;
  Action draw_panel() override;

  double images_per_second() const override { return std::max(1.0, frame().results_per_second); }
  maquette::Saver::Companions companions() const override;
  void add_to_report(nlohmann::ordered_json* report) const override;

 private:
  const maquette::MappedFrame& frame() const { return frames_.front(); }
  void draw_marks() const;  // skeletons, and in their view boxes
  void draw_views();
  void draw_model_options();

  maq_densepose_config model_;
  float roll_rad_ = 0;
  View view_;
  bool shows_mesh_, has_surface_ = false;
  std::atomic<bool> wears_colours_;   // the body in the corner, the person's
  float yaw_ = 0.5f, pitch_ = 0.15f;  // of the body
  Rect mesh_rect_;                    // empty where no body is drawn
  maquette::TripleBuffer<maquette::MappedFrame> frames_;
  // The pipeline's thread alone uses these.
  std::vector<uint8_t> seen_;
  maquette::GrowingTexture texture_;
  maquette::LiveDensePose live_;  // last: its thread uses the others
};
