#include <cmath>

#include "api/boundary.h"
#include "api/frame_handle.h"
#include "core/worker_threads.h"
#include "maquette/prediction.h"
#include "prediction/predictor.h"

using namespace maq;

struct maq_predictor : HandleOf<HandleKind::kPredictor> {
  maq_predictor(const PredictorSettings& settings, size_t pool_size)
      : predictor(settings), frames(pool_size, "predicted frames") {}
  Predictor predictor;
  BoundedPool<maq_frame> frames;
};

namespace {

maq_predictor_config default_predictor_config() {
  maq_predictor_config config{};
  config.struct_size = sizeof config;
  config.frame_pool_size = 4;
  return config;
}

}  // namespace

maq_status maq_predictor_config_init(maq_predictor_config* config, uint32_t struct_size) {
  return init_config(__func__, config, struct_size, default_predictor_config(), sizeof(maq_predictor_config));
}

maq_status maq_predictor_create(maq_context* context, const maq_predictor_config* given, maq_predictor** predictor) {
  return guarded(context, __func__, [&] {
    require_argument(context, "context");
    require_argument(predictor, "predictor");
    const maq_predictor_config config =
        read_config(given, "config", default_predictor_config(), sizeof(maq_predictor_config));
    require_range("config.threads", config.threads, 0, kMaxThreads);
    require_range("config.method", number_in(config.method), int32_t(MAQ_PREDICTION_AUTO),
                  int32_t(MAQ_PREDICTION_MOTION));
    require_range("config.frame_pool_size", config.frame_pool_size, 1u, 64u);
    const PredictorSettings settings{config.method, config.threads != 0 ? config.threads : default_threads()};
    *predictor = new maq_predictor(settings, config.frame_pool_size);
    return MAQ_OK;
  });
}

void maq_predictor_destroy(maq_predictor* predictor) { destroy(predictor, "predictor", __func__); }

maq_status maq_predictor_push(maq_predictor* predictor, const maq_frame* frame) {
  return guarded_alone(predictor, "predictor", __func__, [&] {
    require_argument(frame, "frame");
    predictor->predictor.push(frame->frame);
    return MAQ_OK;
  });
}

maq_status maq_predictor_predict(maq_predictor* predictor, double ahead_s, maq_frame** frame) {
  return guarded_alone(predictor, "predictor", __func__, [&] {
    require_argument(frame, "frame");
    require_range("ahead_s", ahead_s, 0.0, double(Predictor::kMaxAhead_ns) / 1e9);
    BoundedPool<maq_frame>::Pooled handle = predictor->frames.acquire();
    predictor->predictor.predict(int64_t(std::llround(ahead_s * 1e9)), handle->frame);
    *frame = lend<maq_frame>(std::move(handle));
    return MAQ_OK;
  });
}

maq_status maq_predictor_restart(maq_predictor* predictor) {
  return guarded_alone(predictor, "predictor", __func__, [&] {
    predictor->predictor.restart();
    return MAQ_OK;
  });
}

maq_status maq_predictor_get_stats(const maq_predictor* predictor, maq_predictor_stats* stats) {
  return guarded_alone(predictor, "predictor", __func__, [&] {
    const PredictorStats& from = predictor->predictor.stats();
    write_struct(
        stats, "stats",
        maq_predictor_stats{0, from.grey_ms, from.flow_ms, from.choice_ms, from.push_ms, from.project_ms, from.fetch_ms,
                            from.predict_ms, from.method, from.pushed, from.predicted, from.restarts},
        sizeof(maq_predictor_stats));
    return MAQ_OK;
  });
}
