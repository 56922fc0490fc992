#pragma once

#include <cstdint>
#include <memory>
#include <utility>

#include "api/frame_handle.h"
#include "api/handle.h"
#include "maquette/camera_health.h"
#include "maquette/prediction.h"
#include "prediction/codec/frame_decoder.h"
#include "prediction/frame_predictor.h"
#include "prediction/health/camera_health.h"
#include "prediction/sampling/sampled_predictor.h"

namespace maq {

// Makes any number of predictors with the same settings and networks, one for each stream.
struct PredictorRecipe {
  PredictionMethod method = PredictionMethod::kAuto;
  MotionSettings motion;
  SamplingSettings sampling;  // kSampled
  SamplerNetworks sampler;    // kSampled
};

std::unique_ptr<FramePredictor> make_predictor(const PredictorRecipe& recipe);

// `match`: of the same frame.
maq_camera_health_result result_of(const HealthResult& found, const Frame& frame, const PictureMatch& match);

}  // namespace maq

struct maq_predictor : maq::HandleOf<maq::HandleKind::kPredictor> {
  maq_predictor(maq::PredictorRecipe of, size_t pool_size)
      : recipe(std::move(of)), predictor(maq::make_predictor(recipe)), frames(pool_size, "predicted frames") {}

  // Null unless the method samples.
  maq::SampledPredictor* sampled() const {
    if (recipe.method != maq::PredictionMethod::kSampled) return nullptr;
    return static_cast<maq::SampledPredictor*>(predictor.get());
  }

  const maq::PredictorRecipe recipe;
  const std::unique_ptr<maq::FramePredictor> predictor;
  maq::BoundedPool<maq_frame> frames;
};

struct maq_camera_health : maq::HandleOf<maq::HandleKind::kCameraHealth> {
  maq::CameraHealth health;
  float push_ms = 0;
  uint64_t pushed = 0, events = 0, starts = 0;
};
