#include <atomic>
#include <cmath>
#include <memory>
#include <utility>

#include "api/boundary.h"
#include "api/bundle_argument.h"
#include "api/prediction_handles.h"
#include "api/source_handle.h"
#include "core/worker_threads.h"
#include "maquette/concealer.h"
#include "concealment/concealer.h"

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

constexpr char kPredictorBundle[] = "prediction-int8";
constexpr const char* kConcealedTwice = "The source has a concealer already; destroy that first.";

maq_concealer_config default_concealer_config() {
  maq_concealer_config config{};
  config.struct_size = sizeof config;
  config.max_gap_ms = 300;
  config.frame_pool_size = 3;
  return config;
}

PredictorSettings predictor_settings(const ContextState& state, int32_t threads, const maq_prediction_method& method,
                                     maq_prediction_method last_method) {
  require_range("config.threads", threads, 0, kMaxThreads);
  require_range("config.method", number_in(method), int32_t(MAQ_PREDICTION_AUTO), int32_t(last_method));
  return {method, threads != 0 ? threads : default_threads(), state.predictor_workspaces()};
}

maq_predictor_config default_predictor_config() {
  maq_predictor_config config{};
  config.struct_size = sizeof config;
  config.frame_pool_size = 4;
  return config;
}

struct NetworksOfMode {
  PredictionNetworks networks;
  NetworkMode mode = NetworkMode::kMended;
};

// Throws what opening them throws, and MAQ_ERROR_UNSUPPORTED where the bundle has none of that mode.
NetworksOfMode open_networks_of_mode(ContextState& state, const maq_predictor_config& config, int threads) {
  require_range("config.network_mode", number_in(config.network_mode), int32_t(MAQ_NETWORK_AUTO),
                int32_t(MAQ_NETWORK_DRAWN));
  const CodeBundle bundle(read_bundle_argument(config, "config", kPredictorBundle));
  SessionSettings session;
  session.threads = threads;
  maq_network_mode mode = config.network_mode;
  if (mode == MAQ_NETWORK_AUTO) {
    mode = MendedPicture::is_in(bundle)   ? MAQ_NETWORK_MENDED
           : ExpectedFrame::is_in(bundle) ? MAQ_NETWORK_EXPECTED
                                          : MAQ_NETWORK_DRAWN;
  }
  const bool is_there = mode == MAQ_NETWORK_MENDED     ? MendedPicture::is_in(bundle)
                        : mode == MAQ_NETWORK_EXPECTED ? ExpectedFrame::is_in(bundle)
                                                       : TransformerBundle::is_in(bundle);
  if (!is_there) {
    throw Error(MAQ_ERROR_UNSUPPORTED, "Bundle ", bundle.bundle.manifest.name,
                " has no networks that foresee pictures so; use another bundle, network_mode or method.");
  }
  NetworksOfMode opened;
  opened.networks.workspaces = state.predictor_workspaces();
  opened.networks.encoder = std::make_shared<FrameEncoder>(state.onnxruntime(), bundle, session);
  if (mode != MAQ_NETWORK_MENDED) {
    opened.networks.decoder = std::make_shared<FrameDecoder>(state.onnxruntime(), bundle, session);
  }
  switch (mode) {
    case MAQ_NETWORK_DRAWN:
      opened.mode = NetworkMode::kDrawn;
      opened.networks.transformer = std::make_shared<CodeTransformer>(state.onnxruntime(), bundle, session);
      break;
    case MAQ_NETWORK_EXPECTED:
      opened.mode = NetworkMode::kExpected;
      opened.networks.expected = std::make_shared<ExpectedFrame>(state.onnxruntime(), bundle, session);
      break;
    default:
      opened.mode = NetworkMode::kMended;
      opened.networks.mended = std::make_shared<MendedPicture>(state.onnxruntime(), bundle, session);
  }
  return opened;
}

std::unique_ptr<NetworkPredictor> network_predictor(ContextState& state, const maq_predictor_config& config,
                                                    int threads) {
  NetworksOfMode own;
  if (config.networks_of != nullptr) {
    require_argument(config.networks_of, "config.networks_of");
    const NetworkPredictor* const other = config.networks_of->by_network.get();
    if (other == nullptr) throw ArgumentError("config.networks_of has no networks; its method is another.");
    own = {other->networks(), other->settings().mode};
  } else {
    own = open_networks_of_mode(state, config, threads);
  }
  NetworkSettings settings;
  settings.mode = own.mode;
  if (own.mode == NetworkMode::kDrawn) {
    settings.sampling = {config.temperature, config.top_k, config.seed};
    const CodeSampler checked(settings.sampling, own.networks.encoder->codes().entries);
    require_range("config.passes", config.passes, 0u, uint32_t(CodeTransformer::kMaxPasses));
    settings.passes = config.passes;
  }
  return std::make_unique<NetworkPredictor>(std::move(own.networks), settings, threads);
}

NetworkPredictor& drawing(const maq_predictor* predictor) {
  if (predictor->by_network == nullptr) {
    throw Error(MAQ_ERROR_UNSUPPORTED, "This predictor draws no samples; make one whose method is by networks.");
  }
  return *predictor->by_network;
}

}  // namespace

maq_status maq_predictor_config_init(maq_predictor_config* config, uint32_t struct_size) {
  return init_config(__func__, config, struct_size, default_predictor_config());
}

maq_status maq_predictor_create(maq_context* context, const maq_predictor_config* given, maq_predictor** predictor) {
  return guarded(context, __func__, [&] {
    require_argument(context, "context");
    require_argument(predictor, "predictor");
    const maq_predictor_config config = read_config(given, "config", default_predictor_config());
    require_range("config.frame_pool_size", config.frame_pool_size, 1u, 64u);
    const PredictorSettings settings =
        predictor_settings(*context->state, config.threads, config.method, MAQ_PREDICTION_NETWORK);
    std::unique_ptr<Predictor> alone;
    std::unique_ptr<NetworkPredictor> by_networks;
    if (config.method == MAQ_PREDICTION_NETWORK) {
      by_networks = network_predictor(*context->state, config, settings.threads);
    } else {
      alone = std::make_unique<Predictor>(settings);
    }
    *predictor = new maq_predictor(std::move(alone), std::move(by_networks), config.frame_pool_size);
    return MAQ_OK;
  });
}

void maq_predictor_destroy(maq_predictor* predictor) { destroy(predictor, "predictor", __func__); }

maq_status maq_predictor_push(maq_predictor* predictor, const maq_frame* frame) {
  return guarded_alone(predictor, "predictor", __func__, [&] {
    require_argument(frame, "frame");
    predictor->by_network ? predictor->by_network->push(frame->frame) : predictor->predictor->push(frame->frame);
    return MAQ_OK;
  });
}

maq_status maq_predictor_predict(maq_predictor* predictor, double ahead_s, maq_frame** frame) {
  return guarded_alone(predictor, "predictor", __func__, [&] {
    require_argument(frame, "frame");
    require_range("ahead_s", ahead_s, 0.0, double(Predictor::kMaxAhead_ns) / 1e9);
    BoundedPool<maq_frame>::Pooled handle = predictor->frames.acquire();
    const int64_t ahead_ns = std::llround(ahead_s * 1e9);
    predictor->by_network ? predictor->by_network->predict(ahead_ns, handle->frame)
                          : predictor->predictor->predict(ahead_ns, handle->frame);
    *frame = lend<maq_frame>(std::move(handle));
    return MAQ_OK;
  });
}

maq_status maq_predictor_draw(maq_predictor* predictor, uint32_t sample_count, uint32_t frame_count, double step_s) {
  return guarded_alone(predictor, "predictor", __func__, [&] {
    require_range("sample_count", sample_count, 1u, uint32_t(CodeTransformer::kMaxSamples));
    require_range("frame_count", frame_count, 1u, uint32_t(NetworkPredictor::kMaxDrawn));
    require_range("step_s", step_s, 1e-6, double(NetworkPredictor::kMaxStep_ns) / 1e9);
    drawing(predictor).draw(sample_count, frame_count, std::llround(step_s * 1e9));
    return MAQ_OK;
  });
}

maq_status maq_predictor_acquire_drawn(maq_predictor* predictor, uint32_t sample, uint32_t number, maq_frame** frame) {
  return guarded_alone(predictor, "predictor", __func__, [&] {
    require_argument(frame, "frame");
    BoundedPool<maq_frame>::Pooled handle = predictor->frames.acquire();
    drawing(predictor).drawn_picture(sample, number, handle->frame);
    *frame = lend<maq_frame>(std::move(handle));
    return MAQ_OK;
  });
}

maq_status maq_predictor_copy_uncertainty(const maq_predictor* predictor, uint32_t sample, uint32_t number, float* bits,
                                          size_t count) {
  return guarded_alone(predictor, "predictor", __func__, [&] {
    require_argument(bits, "bits");
    const NetworkPredictor& by_network = drawing(predictor);
    if (count < by_network.places()) {
      throw ArgumentError("bits has room for ", count, " cells, but ", by_network.places(), " are written.");
    }
    by_network.drawn_entropy(sample, number, bits);
    return MAQ_OK;
  });
}

maq_status maq_predictor_reset(maq_predictor* predictor) {
  return guarded_alone(predictor, "predictor", __func__, [&] {
    predictor->by_network ? predictor->by_network->reset() : predictor->predictor->reset();
    return MAQ_OK;
  });
}

static_assert(int(NetworkMode::kMended) + 1 == MAQ_NETWORK_MENDED && int(NetworkMode::kDrawn) + 1 == MAQ_NETWORK_DRAWN);

maq_status maq_predictor_get_stats(const maq_predictor* predictor, maq_predictor_stats* stats) {
  return guarded_alone(predictor, "predictor", __func__, [&] {
    const NetworkPredictor* const by_network = predictor->by_network.get();
    const PredictorStats& from = by_network != nullptr ? by_network->stats() : predictor->predictor->stats();
    const DrawCounts counts = by_network != nullptr ? by_network->counts() : DrawCounts{};
    const bool has_run = counts.steps + counts.passes > 0;
    write_struct(
        stats, "stats",
        maq_predictor_stats{0, from.grey_ms, from.flow_ms, from.choice_ms, from.push_ms, from.project_ms, from.fetch_ms,
                            from.predict_ms, from.method, from.motion_fraction, from.pushed, from.predicted,
                            from.resets, by_network != nullptr ? by_network->networks_ms() : 0.0f,
                            by_network != nullptr ? uint32_t(by_network->steps()) : 0u,
                            by_network != nullptr ? uint32_t(by_network->places()) : 0u,
                            has_run ? maq_network_mode(int(by_network->settings().mode) + 1) : MAQ_NETWORK_AUTO,
                            uint32_t(counts.steps), uint32_t(counts.passes)});
    return MAQ_OK;
  });
}

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
    require_range("config.max_gap_ms", config.max_gap_ms, 1, 10000);
    require_range("config.frame_pool_size", config.frame_pool_size, 1u, 64u);
    const PredictorSettings predictor =
        predictor_settings(*context->state, config.threads, config.method, MAQ_PREDICTION_MOTION);
    if (source->is_concealed->exchange(true)) {
      throw Error(MAQ_ERROR_BUSY, kConcealedTwice);
    }
    try {
      *concealer = new maq_concealer(*source, {predictor, config.max_gap_ms}, config.frame_pool_size);
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
