// Edges of a depth camera, a recording or a depth image, live: depth in colours with curves over it, sizes of boxes,
// and the target at the pointer.
#pragma once

#include <app/edges_frame.h>
#include <app/live_edges.h>
#include <app/triple_buffer.h>
#include <array>
#include <atomic>
#include <optional>

#include "live_view.h"

class EdgesDrawing;

class EdgesView final : public LiveView {
 public:
  EdgesView(const maquette::Context& context, const Options& options, const Window& window, Painter& painter);

  void set_visible(bool is_visible) override;
  bool update() override;
  Action press(int key) override;
  void steer(const Steering&, const Rect&) override {}
  void draw(const Rect& area) override;
  Action draw_panel() override;

  double images_per_second() const override { return std::max(1.0, frame().results_per_second); }
  maquette::Saver::Companions companions() const override;
  void add_to_report(nlohmann::ordered_json* report) const override;

 private:
  const maquette::EdgesFrame& frame() const { return frames_.front(); }
  std::optional<maquette::Pixel> pointer(const EdgesDrawing& drawing) const;
  void upload();
  void set_layer(maquette::EdgeLayer layer);
  void draw_layers();
  void draw_model_options();
  void draw_formats();

  maquette::LiveEdgesOptions model_;
  std::atomic<maquette::EdgeLayer> layer_;  // that the pipeline's thread draws
  maquette::RgbaImage redrawn_;             // of a frame that was drawn as another layer
  maquette::EdgesPick pick_;                // at the pointer, of the frame that was drawn last
  std::array<bool, 5> formats_ = {false, false, false, false, true};  // of curves, for a snapshot
  maquette::TripleBuffer<maquette::EdgesFrame> frames_;
  maquette::LiveEdges live_;  // last: its thread uses the others
};
