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
  std::optional<NoveltyScore> novelty;
  bool is_event = false;
};

class PredictionModel : public LiveModel {
 public:
  // Makes streams of its own with the settings and the networks of the handles.
  PredictionModel(const maq_predictor& predictor, double ahead_s, const maq_novelty* novelty)
      : predictor_(make_predictor(predictor.recipe)), ahead_ns_(std::llround(ahead_s * 1e9)) {
    if (novelty == nullptr) return;
    novelty_ = std::make_unique<Novelty>(novelty->novelty.encoder(), novelty->novelty.transformer());
    event_ratio_ = novelty->event_ratio;
  }

  void run(const Frame& frame, const maq_intrinsics*, std::unique_ptr<LiveOutput>& output) override {
    auto& made = reuse_output<PredictionOutput>(output);
    predictor_->push(frame);
    predictor_->predict(ahead_ns_, made.predicted.frame);
    made.novelty.reset();
    if (novelty_ == nullptr) return;
    made.novelty = novelty_->push(frame);
    made.is_event = made.novelty->is_event(event_ratio_);
  }

  void reset() override {
    predictor_->reset();
    if (novelty_ != nullptr) novelty_->reset();
  }

 private:
  const std::unique_ptr<FramePredictor> predictor_;
  std::unique_ptr<Novelty> novelty_;  // null: novelty is not scored
  int64_t ahead_ns_ = 0;
  float event_ratio_ = 0;
};

}  // namespace

maq_status maq_prediction_model_create(maq_context* context, const maq_predictor* predictor, double ahead_s,
                                       const maq_novelty* novelty, maq_model** model) {
  return guarded(context, __func__, [&] {
    require_argument(context, "context");
    require_argument(predictor, "predictor");
    require_range("ahead_s", ahead_s, 0.0, double(FramePredictor::kMaxAhead_ns) / 1e9);
    if (novelty != nullptr) require_argument(novelty, "novelty");
    require_argument(model, "model");
    *model = new maq_model(std::make_shared<PredictionModel>(*predictor, ahead_s, novelty));
    return MAQ_OK;
  });
}

const maq_frame* maq_pipeline_result_get_predicted_frame(const maq_pipeline_result* result) {
  return part_of<PredictionOutput>(result, __func__,
                                   [](PredictionOutput& output) -> const maq_frame* { return &output.predicted; });
}

maq_status maq_pipeline_result_get_novelty(const maq_pipeline_result* result, maq_novelty_score* score) {
  return guarded(result, __func__, [&] {
    const auto* const output = output_of<PredictionOutput>(result);
    if (output == nullptr || !output->novelty) {
      throw Error(MAQ_ERROR_NOT_FOUND, "The model of this result does not score novelty.");
    }
    maq_novelty_score filled{};
    filled.bits = output->novelty->bits;
    filled.ratio = output->novelty->ratio;
    filled.is_event = output->is_event ? 1 : 0;
    filled.is_cut = output->novelty->is_cut ? 1 : 0;
    filled.is_stream_start = output->novelty->is_stream_start ? 1 : 0;
    write_struct(score, "score", filled);
    return MAQ_OK;
  });
}
