// A source and, beside it, what it will show a moment later. When the user wants it, its short gaps are bridged, how
// surprising it is is drawn over and below it, how uncertain what comes is over that, and beside them a picture that
// may come. What is made up has a border in magenta and says so.
#pragma once

#include <app/prediction/live_prediction.h>
#include <app/triple_buffer.h>
#include <algorithm>

#include "live_view.h"

class NextView final : public LiveView {
 public:
  NextView(const maquette::Context& context, const Options& options, const Window& window, Painter& painter);

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
  bool draw_uncertainty();

  maquette::PredictionChoice choice_;
  Rect now_rect_, next_rect_, sample_rect_, curve_rect_;
  maquette::TripleBuffer<maquette::PredictionFrame> frames_;
  maquette::LivePrediction live_;  // last: its thread uses the others
};
