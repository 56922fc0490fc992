// Prediction as a model of a pipeline, for C++17; a part of maquette.hpp.
#ifndef MAQUETTE_PREDICTION_MODEL_HPP_
#define MAQUETTE_PREDICTION_MODEL_HPP_

#include <optional>

#include "maquette/pipeline.hpp"
#include "maquette/prediction.hpp"
#include "maquette/prediction_model.h"

namespace maquette {

class PredictionModel : public Model {
 public:
  // `novelty` null: novelty is not scored.
  PredictionModel(const Context& context, const Predictor& predictor, double ahead_s,
                  const Novelty* novelty = nullptr) {
    maq_model* made = nullptr;
    check(maq_prediction_model_create(context.get(), predictor.get(), ahead_s,
                                      novelty != nullptr ? novelty->get() : nullptr, &made));
    own(made);
  }
};

// Nothing if another model ran.
inline std::optional<Frame> predicted_frame_of(const PipelineResult& result) {
  const maq_frame* const frame = maq_pipeline_result_get_predicted_frame(result.get());
  if (frame == nullptr) return std::nullopt;
  return Frame(result.part(frame));
}

// Nothing if the model does not score novelty.
inline std::optional<maq_novelty_score> novelty_of(const PipelineResult& result) {
  maq_novelty_score score{};
  score.struct_size = sizeof score;
  const maq_status status = maq_pipeline_result_get_novelty(result.get(), &score);
  if (status == MAQ_ERROR_NOT_FOUND) return std::nullopt;
  check(status);
  return score;
}

}  // namespace maquette

#endif  // MAQUETTE_PREDICTION_MODEL_HPP_
