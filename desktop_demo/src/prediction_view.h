// Shows a source and its predicted frame. On request: short gaps concealed, camera health over and below the source,
// entropy over the predicted frame, and a sampled future beside them. Predicted images have a magenta border and a
// text.
#pragma once

#include <app/prediction/live_prediction.h>
#include <app/triple_buffer.h>
#include <algorithm>

#include "live_view.h"

class PredictionView final : public LiveView {
 public:
  PredictionView(const maquette::Context& context, const Options& options, const Window& window, Painter& painter);

  void set_visible(bool is_visible) override;
  bool update() override;
  Action press(int key) override;
  void steer(const Steering& steering, const Rect& area) override;
  void draw(const Rect& area) override;
  Action draw_panel() override;

  double images_per_second() const override { return std::max(1.0, frame().results_per_second); }
  void add_to_report(nlohmann::ordered_json* report) const override;

 private:
  const maquette::PredictionFrame& frame() const { return frames_.front(); }
  void place(Rect area);
  void mark(const Rect& rect, bool is_predicted, const std::string& text) const;
  void draw_gaps();
  bool draw_entropy_text();

  maquette::PredictionChoice choice_;
  Rect now_rect_, next_rect_, sample_rect_, curve_rect_;
  maquette::TripleBuffer<maquette::PredictionFrame> frames_;
  maquette::LivePrediction live_;  // last: its thread uses the others
};
