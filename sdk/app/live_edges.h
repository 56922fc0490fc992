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

// The options of the model, and the parts that run.
struct LiveEdgesOptions {
  maq_edges_config edges = default_edges_config();
  bool finds_curves = true;
  bool finds_boxes = true;  // among the curves
};

class LiveEdges : public LivePipeline {
 public:
  LiveEdges(const Context& context, const LiveEdgesOptions& model,
            std::function<void(PipelineResult, double)> on_result, std::function<void()> on_change = nullptr,
            const LiveOptions& options = {})
      : LivePipeline(context, model_of(context, model), std::move(on_result), std::move(on_change), options),
        context_(context) {}

  // Loads the model with other options; edges of a depth image are found again. Returns at once.
  void set_model(const LiveEdgesOptions& model) { pipeline().set_model(model_of(context_, model)); }

 private:
  static EdgesModel model_of(const Context& context, const LiveEdgesOptions& model) {
    maq_edges_curves_config curves = default_edges_curves_config();
    curves.skip_boxes = model.finds_boxes ? 0 : 1;
    return EdgesModel(context, model.edges, model.finds_curves ? &curves : nullptr);
  }

  const Context& context_;
};

}  // namespace maquette
