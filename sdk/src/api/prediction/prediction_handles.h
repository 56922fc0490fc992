#pragma once

#include <cstdint>
#include <memory>
#include <utility>

#include "api/frame_handle.h"
#include "api/handle.h"
#include "maquette/novelty.h"
#include "maquette/prediction.h"
#include "prediction/codec/frame_decoder.h"
#include "prediction/frame_predictor.h"
#include "prediction/novelty/novelty.h"
#include "prediction/refine/refined_predictor.h"
#include "prediction/sampling/sampled_predictor.h"

namespace maq {

// Makes any number of predictors with the same settings and networks, one for each stream.
struct PredictorRecipe {
  PredictionMethod method = PredictionMethod::kAuto;
  MotionSettings motion;
  SamplingSettings sampling;  // kSampled
  RefinerNetworks refiner;    // kRefined
  SamplerNetworks sampler;    // kSampled
};

std::unique_ptr<FramePredictor> make_predictor(const PredictorRecipe& recipe);

// Shared by novelty streams.
struct NoveltyNetworks {
  std::shared_ptr<FrameEncoder> encoder;
  std::shared_ptr<FrameDecoder> decoder;
  std::shared_ptr<CodeTransformer> transformer;  // null: the bigram prior
};

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

struct maq_novelty : maq::HandleOf<maq::HandleKind::kNovelty> {
  maq_novelty(std::shared_ptr<maq::ContextState> of, maq::NoveltyNetworks networks, float ratio)
      : state(std::move(of)),
        novelty(std::move(networks.encoder), std::move(networks.transformer)),
        decoder(std::move(networks.decoder)),
        event_ratio(ratio) {}
  std::shared_ptr<maq::ContextState> state;
  maq::Novelty novelty;
  std::shared_ptr<maq::FrameDecoder> decoder;
  maq::BoundedPool<maq_frame> reconstructions{4, "reconstructions"};
  // The latest frame:
  int64_t timestamp_ns = 0;
  uint64_t sequence = 0;
  maq_clock clock = MAQ_CLOCK_MEDIA;
  const float event_ratio;
  float push_ms = 0;
  uint64_t pushed = 0, events = 0, starts = 0;
};
