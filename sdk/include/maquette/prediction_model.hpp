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
  PredictionModel(const Context& context, const Predictor& predictor, double ahead_s, bool checks_camera = false) {
    maq_model* made = nullptr;
    check(maq_prediction_model_create(context.get(), predictor.get(), ahead_s, checks_camera ? 1 : 0, &made));
    own(made);
  }
};

// Nothing if another model ran.
inline std::optional<Frame> predicted_frame_of(const PipelineResult& result) {
  const maq_frame* const frame = maq_pipeline_result_get_predicted_frame(result.get());
  if (frame == nullptr) return std::nullopt;
  return Frame(result.part(frame));
}

// Nothing if the model does not check the camera.
inline std::optional<maq_camera_health_result> camera_health_of(const PipelineResult& result) {
  maq_camera_health_result health{};
  health.struct_size = sizeof health;
  const maq_status status = maq_pipeline_result_get_camera_health(result.get(), &health);
  if (status == MAQ_ERROR_NOT_FOUND) return std::nullopt;
  check(status);
  return health;
}

}  // namespace maquette

#endif  // MAQUETTE_PREDICTION_MODEL_HPP_
