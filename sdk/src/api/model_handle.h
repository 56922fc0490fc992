// The handles of pipelines that systems know: models, and results with the outputs of models.
#pragma once

#include <memory>
#include <utility>

#include "api/boundary.h"
#include "api/frame_handle.h"
#include "maquette/pipeline.h"
#include "pipeline/live_model.h"
#include "pipeline/pipeline.h"

struct maq_model : maq::HandleOf<maq::HandleKind::kModel> {
  explicit maq_model(std::shared_ptr<maq::LiveModel> made) : model(std::move(made)) {}
  const std::shared_ptr<maq::LiveModel> model;
};

// `frame` and the handles in `output` are parts: they live and are returned with the result.
struct maq_pipeline_result : maq::HandleOf<maq::HandleKind::kPipelineResult> {
  maq_pipeline_result() { frame.set_held(false); }
  maq_frame frame;
  std::unique_ptr<maq::LiveOutput> output;
  maq::PipelineTimes times;
  maq::BoundedPool<maq_pipeline_result>::Deleter deleter;
};

namespace maq {

// Returns the model as one of the system whose adapter is T. Throws ArgumentError for models of other systems.
template <class T>
T& require_model(const maq_model* model, const char* system) {
  require_argument(model, "model");
  auto* const found = dynamic_cast<T*>(model->model.get());
  if (found == nullptr) throw ArgumentError("model is not a model of ", system, ".");
  return *found;
}

// Returns the output of such a model in the result; nullptr if another model ran.
template <class T>
T* output_of(const maq_pipeline_result* result) {
  require_argument(result, "result");
  return dynamic_cast<T*>(result->output.get());
}

// Implements the getters of parts: `get` returns a part of T or nullptr.
template <class T, class Get>
auto part_of(const maq_pipeline_result* result, const char* function, Get&& get) noexcept
    -> decltype(get(std::declval<T&>())) {
  decltype(get(std::declval<T&>())) part = nullptr;
  if (result == nullptr) return part;
  guarded(result, function, [&] {
    if (T* const output = output_of<T>(result)) part = get(*output);
    return MAQ_OK;
  });
  return part;
}

}  // namespace maq
