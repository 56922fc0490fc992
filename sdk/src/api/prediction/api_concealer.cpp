#include <atomic>
#include <memory>
#include <utility>

#include "api/boundary.h"
#include "api/prediction/prediction_methods.h"
#include "api/source_handle.h"
#include "concealment/concealer.h"
#include "core/worker_threads.h"
#include "maquette/concealer.h"

using namespace maq;

struct maq_concealer : HandleOf<HandleKind::kConcealer> {
  maq_concealer(const maq_source& source, const ConcealerSettings& settings, size_t pool_size)
      : is_concealed(source.is_concealed), frames(pool_size, "frames"), concealer(source.source, settings) {}
  ~maq_concealer() { *is_concealed = false; }
  std::shared_ptr<std::atomic<bool>> is_concealed;
  BoundedPool<maq_frame> frames;
  Concealer concealer;
};

namespace {

constexpr const char* kConcealedTwice = "The source has a concealer already; destroy that first.";
constexpr uint32_t kConcealerPoolSize = 3;
constexpr int32_t kDefaultMaxGap_ms = 300;

maq_concealer_config default_concealer_config() {
  maq_concealer_config config{};
  config.struct_size = sizeof config;
  return config;
}

ConcealerSettings concealer_settings(const ContextState& state, const maq_concealer_config& config) {
  require_range("config.max_gap_ms", config.max_gap_ms, 0, 10000);
  require_range("config.threads", config.threads, 0, kMaxThreads);
  require_range("config.method", number_in(config.method), int32_t(MAQ_PREDICTOR_AUTO), int32_t(MAQ_PREDICTOR_MOTION));
  MotionSettings motion{method_of(config.method), config.threads != 0 ? config.threads : default_threads(),
                        state.motion_workspaces()};
  return {std::move(motion), config.max_gap_ms != 0 ? config.max_gap_ms : kDefaultMaxGap_ms};
}

}  // namespace

maq_status maq_concealer_config_init(maq_concealer_config* config, uint32_t struct_size) {
  return init_config(__func__, config, struct_size, default_concealer_config());
}

maq_status maq_concealer_create(maq_context* context, maq_source* source, const maq_concealer_config* given,
                                maq_concealer** concealer) {
  return guarded(context, __func__, [&] {
    require_argument(context, "context");
    require_argument(source, "source");
    require_argument(concealer, "concealer");
    const maq_concealer_config config = read_config(given, "config", default_concealer_config());
    require_range("config.frame_pool_size", config.frame_pool_size, 0u, 64u);
    const ConcealerSettings settings = concealer_settings(*context->state, config);
    if (source->is_concealed->exchange(true)) {
      throw Error(MAQ_ERROR_BUSY, kConcealedTwice);
    }
    try {
      *concealer = new maq_concealer(*source, settings,
                                     config.frame_pool_size != 0 ? config.frame_pool_size : kConcealerPoolSize);
    } catch (...) {
      *source->is_concealed = false;
      throw;
    }
    return MAQ_OK;
  });
}

void maq_concealer_destroy(maq_concealer* concealer) { destroy(concealer, "concealer", __func__); }

maq_status maq_concealer_acquire_frame(maq_concealer* concealer, int64_t timeout_ns, maq_frame** frame) {
  return guarded_alone(concealer, "concealer", __func__, [&] {
    require_argument(frame, "frame");
    BoundedPool<maq_frame>::Pooled handle = concealer->frames.acquire();
    switch (concealer->concealer.next(timeout_ns, handle->frame)) {
      case NextFrame::kFrame: break;
      case NextFrame::kEnd: return MAQ_END_OF_STREAM;
      case NextFrame::kTimeout:
        return keep_error(concealer, MAQ_TIMEOUT, nullptr,
                          concatenate("No frame came within ", timeout_ns / 1000000, " ms.").c_str());
      case NextFrame::kStopped: return keep_error(concealer, MAQ_CANCELLED, nullptr, "The source was stopped.");
    }
    *frame = lend<maq_frame>(std::move(handle));
    return MAQ_OK;
  });
}

maq_status maq_concealer_get_stats(const maq_concealer* concealer, maq_concealer_stats* stats) {
  return guarded(concealer, __func__, [&] {
    require_argument(concealer, "concealer");
    const ConcealerStats from = concealer->concealer.stats();
    write_struct(stats, "stats",
                 maq_concealer_stats{0, from.captured, from.predicted, from.late, from.dropped, from.latest_gap_ms,
                                     from.latest_wait_ms, from.max_wait_ms});
    return MAQ_OK;
  });
}
