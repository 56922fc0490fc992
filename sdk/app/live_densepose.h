// Dense pose of a camera or a file, live.
//
//   maquette::TripleBuffer<Shown> shown;
//   maquette::LiveDensePose live(context, config, [&](maquette::PipelineResult result, double) {
//     shown.back().copy_from(result);  // on the pipeline's thread
//     shown.publish();
//   });
//   live.open("camera:");
//   for (;;) { if (shown.take()) draw(shown.front()); write(live.status().problem); }
#pragma once

#include <utility>

#include "app/live_pipeline.h"

namespace maquette {

class LiveDensePose : public LivePipeline {
 public:
  LiveDensePose(const Context& context, const maq_densepose_config& config,
                std::function<void(PipelineResult, double)> on_result, std::function<void()> on_change = nullptr,
                const LiveOptions& options = {})
      : LivePipeline(context, running(config), std::move(on_result), std::move(on_change), options) {}

  // Loads the model with other options; a photo is mapped again. Returns at once.
  void set_model(const maq_densepose_config& config) { pipeline().set_densepose(config); }
  void set_roll(float roll_rad) { pipeline().set_roll(roll_rad); }
  // Nothing until a model is loaded that has one.
  std::optional<maq_densepose_surface> surface() const { return pipeline().surface(); }

 private:
  static maq_pipeline_config running(const maq_densepose_config& config) {
    maq_pipeline_config model = default_pipeline_config();
    model.densepose = &config;
    return model;
  }
};

}  // namespace maquette
