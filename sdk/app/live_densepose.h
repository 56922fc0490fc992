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

#include <array>
#include <cmath>
#include <maquette/densepose_mesh.hpp>
#include <optional>
#include <utility>

#include "app/live_pipeline.h"

namespace maquette {

// The camera that shows the body at rest, from far away.
struct BodyCamera {
  std::array<float, 16> projection;  // column by column, as OpenGL takes it
  std::array<float, 3> towards_eye;

  // From a direction, in radians, into a picture. The body stands on z = 0, faces -y and is under 2 m tall and wide.
  BodyCamera(float yaw, float pitch, int width, int height)
      : towards_eye{std::sin(yaw) * std::cos(pitch), -std::cos(yaw) * std::cos(pitch), std::sin(pitch)} {
    const std::array<float, 3> right{std::cos(yaw), std::sin(yaw), 0};
    const std::array<float, 3> up{-std::sin(yaw) * std::sin(pitch), std::cos(yaw) * std::sin(pitch), std::cos(pitch)};
    const float x = float(height) / float(width), middle = 0.85f;
    projection = {right[0] * x,
                  up[0],
                  -towards_eye[0] / 4,
                  0,
                  right[1] * x,
                  up[1],
                  -towards_eye[1] / 4,
                  0,
                  right[2] * x,
                  up[2],
                  -towards_eye[2] / 4,
                  0,
                  0,
                  -middle * up[2],
                  middle * towards_eye[2] / 4,
                  1};
  }
};

class LiveDensePose : public LivePipeline {
 public:
  LiveDensePose(const Context& context, const maq_densepose_config& config,
                std::function<void(PipelineResult, double)> on_result, std::function<void()> on_change = nullptr,
                const LiveOptions& options = {})
      : LiveDensePose(context, DensePoseModel(context, config), std::move(on_result), std::move(on_change), options) {}

  // Loads the model with other options; a photo is mapped again. Returns at once.
  void set_model(const maq_densepose_config& config) {
    DensePoseModel model(context_, config);
    model.set_roll(roll_rad_);
    model.set_frame_budget(frame_budget_ms_);
    pipeline().set_model(model);
    model_ = std::move(model);
  }
  void set_roll(float roll_rad) {
    roll_rad_ = roll_rad;
    model_.set_roll(roll_rad);
  }
  // The body at rest; nothing before a model is loaded that has one.
  std::optional<DensePoseMesh> body() const {
    const std::optional<maq_densepose_surface> surface = model_.surface();
    if (!surface) return std::nullopt;
    const size_t count = size_t(24 * 3) * size_t(surface->nodes) * size_t(surface->nodes);
    return DensePoseMesh({surface->points_m, surface->points_m + count}, surface->nodes);
  }

 private:
  LiveDensePose(const Context& context, DensePoseModel model, std::function<void(PipelineResult, double)> on_result,
                std::function<void()> on_change, const LiveOptions& options)
      : LivePipeline(context, model, std::move(on_result), std::move(on_change), options),
        context_(context),
        model_(std::move(model)),
        frame_budget_ms_(options.frame_budget_ms) {
    model_.set_frame_budget(frame_budget_ms_);
  }

  const Context& context_;
  DensePoseModel model_;
  const double frame_budget_ms_;
  float roll_rad_ = 0;
};

}  // namespace maquette
