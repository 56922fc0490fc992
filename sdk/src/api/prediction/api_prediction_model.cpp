#include <cmath>
#include <optional>

#include "api/boundary.h"
#include "api/model_handle.h"
#include "api/prediction/prediction_handles.h"
#include "maquette/prediction_model.h"

using namespace maq;

namespace {

struct PredictionOutput : LiveOutput {
  PredictionOutput() { predicted.set_held(false); }
  void set_held(bool is_held) noexcept override {
    if (!is_held) predicted.frame.clear();
    predicted.set_held(is_held);
  }
  maq_frame predicted;
  std::optional<maq_camera_health_result> health;
};

class PredictionModel : public LiveModel {
 public:
  // Makes a predictor of its own with the settings and the networks of the handle.
  PredictionModel(const maq_predictor& predictor, double ahead_s, bool checks_camera)
      : predictor_(make_predictor(predictor.recipe)), ahead_ns_(std::llround(ahead_s * 1e9)) {
    if (checks_camera) health_ = std::make_unique<CameraHealth>();
  }

  void run(const Frame& frame, const maq_intrinsics*, std::unique_ptr<LiveOutput>& output) override {
    auto& made = reuse_output<PredictionOutput>(output);
    predictor_->push(frame);
    predictor_->predict(ahead_ns_, made.predicted.frame);
    made.health.reset();
    if (health_ == nullptr) return;
    const HealthResult found = health_->push(frame);
    made.health = result_of(found, frame, health_->match());
  }

  void reset() override {
    predictor_->reset();
    if (health_ != nullptr) health_->reset();
  }

 private:
  const std::unique_ptr<FramePredictor> predictor_;
  std::unique_ptr<CameraHealth> health_;  // null: the camera is not checked
  int64_t ahead_ns_ = 0;
};

}  // namespace

maq_status maq_prediction_model_create(maq_context* context, const maq_predictor* predictor, double ahead_s,
                                       int32_t checks_camera, maq_model** model) {
  return guarded(context, __func__, [&] {
    require_argument(context, "context");
    require_argument(predictor, "predictor");
    require_range("ahead_s", ahead_s, 0.0, double(FramePredictor::kMaxAhead_ns) / 1e9);
    require_argument(model, "model");
    *model = new maq_model(std::make_shared<PredictionModel>(*predictor, ahead_s, checks_camera != 0));
    return MAQ_OK;
  });
}

const maq_frame* maq_pipeline_result_get_predicted_frame(const maq_pipeline_result* result) {
  return part_of<PredictionOutput>(result, __func__,
                                   [](PredictionOutput& output) -> const maq_frame* { return &output.predicted; });
}

maq_status maq_pipeline_result_get_camera_health(const maq_pipeline_result* result, maq_camera_health_result* health) {
  return guarded(result, __func__, [&] {
    const auto* const output = output_of<PredictionOutput>(result);
    if (output == nullptr || !output->health) {
      throw Error(MAQ_ERROR_NOT_FOUND, "The model of this result does not check the camera.");
    }
    write_struct(health, "health", *output->health);
    return MAQ_OK;
  });
}
