// Edges of a depth camera, a recording or a depth image, live, with their curves.
//
//   maquette::TripleBuffer<maquette::EdgesFrame> frames;
//   maquette::LiveEdges live(context, {}, [&](maquette::PipelineResult result, double rate) {
//     frames.back().take(std::move(result), rate, maquette::EdgeLayer::kDepth);  // on the pipeline's thread
//     frames.publish();
//   });
//   live.open("stub:solids");
#pragma once

#include <utility>

#include "app/live_pipeline.h"

namespace maquette {

// What runs, and what is left out.
struct EdgesModel {
  maq_edges_config edges = default_edges_config();
  bool finds_curves = true;
  bool finds_boxes = true;  // among the curves
};

class LiveEdges : public LivePipeline {
 public:
  LiveEdges(const Context& context, const EdgesModel& model, std::function<void(PipelineResult, double)> on_result,
            std::function<void()> on_change = nullptr, const LiveOptions& options = {})
      : LiveEdges(context, model, curves_of(model), std::move(on_result), std::move(on_change), options) {}

  // Loads the model with other options; edges of a depth image are found again. Returns at once.
  void set_model(const EdgesModel& model) {
    const maq_edges_curves_config curves = curves_of(model);
    pipeline().set_edges(model.edges, model.finds_curves ? &curves : nullptr);
  }

 private:
  LiveEdges(const Context& context, const EdgesModel& model, const maq_edges_curves_config& curves,
            std::function<void(PipelineResult, double)> on_result, std::function<void()> on_change,
            const LiveOptions& options)
      : LivePipeline(context, running(model, curves), std::move(on_result), std::move(on_change), options) {}

  static maq_edges_curves_config curves_of(const EdgesModel& model) {
    maq_edges_curves_config curves = default_edges_curves_config();
    curves.find_boxes = model.finds_boxes ? 1 : 0;
    return curves;
  }
  static maq_pipeline_config running(const EdgesModel& model, const maq_edges_curves_config& curves) {
    maq_pipeline_config running = default_pipeline_config();
    running.edges = &model.edges;
    running.curves = model.finds_curves ? &curves : nullptr;
    return running;
  }
};

}  // namespace maquette
