#include <cmath>
#include <memory>
#include <utility>

#include "api/boundary.h"
#include "api/bundle_argument.h"
#include "api/model_options.h"
#include "api/prediction/prediction_handles.h"
#include "api/prediction/prediction_methods.h"
#include "core/worker_threads.h"

using namespace maq;

namespace {

constexpr char kPredictorBundle[] = "prediction-int8";
constexpr uint32_t kPredictorPoolSize = 4;

maq_predictor_config default_predictor_config() {
  maq_predictor_config config{};
  config.struct_size = sizeof config;
  return config;
}

// Throws the exceptions of opening networks; MAQ_ERROR_UNSUPPORTED if the bundle has none for the method.
void open_networks(ContextState& state, const maq_predictor_config& config, PredictorRecipe& recipe) {
  const CodeBundle bundle(read_bundle_argument(config.model, "config.model", kPredictorBundle));
  SessionSettings settings;
  settings.threads = recipe.motion.threads;
  settings.provider = config.model.provider;
  if (!TransformerBundle::is_in(bundle)) {
    throw Error(MAQ_ERROR_UNSUPPORTED, "Bundle ", bundle.bundle.manifest.name,
                " has no network for sampled prediction; use another bundle or method.");
  }
  recipe.sampler = {std::make_shared<FrameEncoder>(state.onnxruntime(), bundle, settings),
                    std::make_shared<FrameDecoder>(state.onnxruntime(), bundle, settings),
                    std::make_shared<CodeTransformer>(state.onnxruntime(), bundle, settings)};
}

void adopt_networks(const maq_predictor* other, PredictorRecipe& recipe) {
  require_argument(other, "config.shared_with");
  if (other->recipe.method != recipe.method) {
    throw ArgumentError("config.shared_with has another method than config.method; give both the same.");
  }
  recipe.sampler = other->recipe.sampler;
}

PredictorRecipe recipe_of(ContextState& state, const maq_predictor_config& config) {
  require_model_options("config.model", config.model, ThreadMeasuring::kUnsupported);
  require_range("config.method", number_in(config.method), int32_t(MAQ_PREDICTOR_AUTO), int32_t(MAQ_PREDICTOR_SAMPLED));
  PredictorRecipe recipe;
  recipe.method = method_of(config.method);
  recipe.motion.threads = config.model.threads != 0 ? config.model.threads : default_threads();
  recipe.motion.workspaces = state.motion_workspaces();
  if (recipe.method != PredictionMethod::kSampled) {
    if (config.shared_with != nullptr) {
      throw ArgumentError("config.shared_with is given, but config.method has no networks to share.");
    }
    recipe.motion.method = recipe.method;
    return recipe;
  }
  if (config.shared_with != nullptr) {
    adopt_networks(config.shared_with, recipe);
  } else {
    open_networks(state, config, recipe);
  }
  recipe.sampling = {config.temperature, config.seed};
  const CodeSampler checked(recipe.sampling, recipe.sampler.encoder->codes().entries);
  return recipe;
}

SampledPredictor& sampled(const maq_predictor* predictor) {
  SampledPredictor* const found = predictor->sampled();
  if (found == nullptr) {
    throw Error(MAQ_ERROR_UNSUPPORTED,
                "This predictor does not sample; create one with the method MAQ_PREDICTOR_SAMPLED.");
  }
  return *found;
}

}  // namespace

namespace maq {

std::unique_ptr<FramePredictor> make_predictor(const PredictorRecipe& recipe) {
  if (recipe.method != PredictionMethod::kSampled) return std::make_unique<MotionPredictor>(recipe.motion);
  return std::make_unique<SampledPredictor>(recipe.sampler, recipe.sampling, recipe.motion);
}

}  // namespace maq

maq_status maq_predictor_config_init(maq_predictor_config* config, uint32_t struct_size) {
  return init_config(__func__, config, struct_size, default_predictor_config());
}

maq_status maq_predictor_create(maq_context* context, const maq_predictor_config* given, maq_predictor** predictor) {
  return guarded(context, __func__, [&] {
    require_argument(context, "context");
    require_argument(predictor, "predictor");
    const maq_predictor_config config = read_config(given, "config", default_predictor_config());
    require_range("config.frame_pool_size", config.frame_pool_size, 0u, 64u);
    *predictor = new maq_predictor(recipe_of(*context->state, config),
                                   config.frame_pool_size != 0 ? config.frame_pool_size : kPredictorPoolSize);
    return MAQ_OK;
  });
}

void maq_predictor_destroy(maq_predictor* predictor) { destroy(predictor, "predictor", __func__); }

maq_status maq_predictor_push(maq_predictor* predictor, const maq_frame* frame) {
  return guarded_alone(predictor, "predictor", __func__, [&] {
    require_argument(frame, "frame");
    predictor->predictor->push(frame->frame);
    return MAQ_OK;
  });
}

maq_status maq_predictor_predict(maq_predictor* predictor, double ahead_s, maq_frame** frame) {
  return guarded_alone(predictor, "predictor", __func__, [&] {
    require_argument(frame, "frame");
    require_range("ahead_s", ahead_s, 0.0, double(FramePredictor::kMaxAhead_ns) / 1e9);
    BoundedPool<maq_frame>::Pooled handle = predictor->frames.acquire();
    predictor->predictor->predict(std::llround(ahead_s * 1e9), handle->frame);
    *frame = lend<maq_frame>(std::move(handle));
    return MAQ_OK;
  });
}

maq_status maq_predictor_sample(maq_predictor* predictor, uint32_t sample_count, uint32_t frame_count, double step_s) {
  return guarded_alone(predictor, "predictor", __func__, [&] {
    require_range("sample_count", sample_count, 1u, uint32_t(CodeTransformer::kMaxSamples));
    require_range("frame_count", frame_count, 1u, uint32_t(SampledPredictor::kMaxFrames));
    require_range("step_s", step_s, 1e-6, double(SampledPredictor::kMaxStep_ns) / 1e9);
    sampled(predictor).sample(sample_count, frame_count, std::llround(step_s * 1e9));
    return MAQ_OK;
  });
}

maq_status maq_predictor_cancel(maq_predictor* predictor) {
  return guarded(predictor, __func__, [&] {
    require_argument(predictor, "predictor");
    if (SampledPredictor* const sampling = predictor->sampled()) sampling->cancel();
    return MAQ_OK;
  });
}

maq_status maq_predictor_acquire_sample(maq_predictor* predictor, uint32_t sample_index, uint32_t frame_index,
                                        maq_frame** frame) {
  return guarded_alone(predictor, "predictor", __func__, [&] {
    require_argument(frame, "frame");
    BoundedPool<maq_frame>::Pooled handle = predictor->frames.acquire();
    sampled(predictor).decode(sample_index, frame_index, handle->frame);
    *frame = lend<maq_frame>(std::move(handle));
    return MAQ_OK;
  });
}

maq_status maq_predictor_copy_entropy_map(const maq_predictor* predictor, uint32_t sample_index, uint32_t frame_index,
                                          float* bits, size_t capacity) {
  return guarded_alone(predictor, "predictor", __func__, [&] {
    require_argument(bits, "bits");
    const SampledPredictor& sampling = sampled(predictor);
    if (capacity < sampling.cells()) {
      throw ArgumentError("capacity is ", capacity, ", but the map has ", sampling.cells(), " cells.");
    }
    sampling.copy_entropy(sample_index, frame_index, bits);
    return MAQ_OK;
  });
}

maq_status maq_predictor_reset(maq_predictor* predictor) {
  return guarded_alone(predictor, "predictor", __func__, [&] {
    predictor->predictor->reset();
    return MAQ_OK;
  });
}

maq_status maq_predictor_get_stats(const maq_predictor* predictor, maq_predictor_stats* stats) {
  return guarded_alone(predictor, "predictor", __func__, [&] {
    const PredictorStats from = predictor->predictor->stats();
    const SampledPredictor* const sampling = predictor->sampled();
    write_struct(
        stats, "stats",
        maq_predictor_stats{0, from.luma_ms, from.flow_ms, from.weights_ms, from.push_ms, from.project_ms, from.warp_ms,
                            from.predict_ms, from.networks_ms, method_of(from.method), from.motion_fraction,
                            from.pushed, from.predicted, from.resets, uint32_t(from.sampled_frames),
                            uint32_t(from.decoding_steps), sampling != nullptr ? uint32_t(sampling->cells()) : 0u});
    return MAQ_OK;
  });
}
