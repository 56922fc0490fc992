#include <algorithm>

#include "api/boundary.h"
#include "api/bundle_argument.h"
#include "api/prediction_handles.h"
#include "core/clock.h"
#include "core/worker_threads.h"

using namespace maq;

namespace {

constexpr char kPredictionBundle[] = "prediction-int8";

maq_surprise_config default_surprise_config() {
  maq_surprise_config config{};
  config.struct_size = sizeof config;
  config.allow_spinning = 1;
  config.event_ratio = 4;
  return config;
}

void require_method(const maq_surprise_config& config) {
  require_range("config.method", number_in(config.method), int32_t(MAQ_SURPRISE_AUTO), int32_t(MAQ_SURPRISE_TABLE));
}

SurpriseNetworks open_networks(ContextState& state, const maq_surprise_config& config) {
  require_threads("config.threads", config.threads, kMaxThreads);
  require_range("config.allow_spinning", config.allow_spinning, 0, 1);
  require_method(config);
  SessionSettings settings;
  settings.threads = config.threads != 0 ? config.threads : default_threads();
  settings.spin = config.allow_spinning == 1;
  const CodeBundle bundle(read_bundle_argument(config, "config", kPredictionBundle));
  SurpriseNetworks made;
  made.encoder = std::make_shared<FrameEncoder>(state.onnxruntime(), bundle, settings);
  settings.threads = made.encoder->threads();
  made.decoder = std::make_shared<FrameDecoder>(state.onnxruntime(), bundle, settings);
  if (config.method == MAQ_SURPRISE_AUTO && TransformerBundle::is_in(bundle)) {
    made.transformer = std::make_shared<CodeTransformer>(state.onnxruntime(), bundle, settings);
  }
  const Manifest& manifest = bundle.bundle.manifest;
  state.log().write(MAQ_LOG_INFO, "Bundle ", manifest.name, " ", manifest.version, " (", manifest.precision,
                    ") loaded, ", settings.threads, " thread(s)");
  return made;
}

}  // namespace

maq_status maq_surprise_config_init(maq_surprise_config* config, uint32_t struct_size) {
  return init_config(__func__, config, struct_size, default_surprise_config());
}

maq_status maq_surprise_create(maq_context* context, const maq_surprise_config* given, maq_surprise** surprise) {
  return guarded(context, __func__, [&] {
    require_argument(context, "context");
    require_argument(surprise, "surprise");
    const maq_surprise_config config = read_config(given, "config", default_surprise_config());
    if (!(config.event_ratio > 1 && config.event_ratio <= 1e6f)) {
      throw ArgumentError("config.event_ratio is ", config.event_ratio, ", but must be above 1, and at most 1e6.");
    }
    SurpriseNetworks networks;
    if (config.networks_of != nullptr) {
      require_argument(config.networks_of, "config.networks_of");
      const maq_surprise& other = *config.networks_of;
      networks = {other.surprise.encoder(), other.decoder, other.surprise.transformer()};
      require_method(config);
      if (config.method == MAQ_SURPRISE_TABLE) networks.transformer = nullptr;
    } else {
      networks = open_networks(*context->state, config);
    }
    *surprise = new maq_surprise(context->state, std::move(networks), config.event_ratio);
    return MAQ_OK;
  });
}

void maq_surprise_destroy(maq_surprise* surprise) { destroy(surprise, "surprise", __func__); }

maq_status maq_surprise_push(maq_surprise* surprise, const maq_frame* frame, maq_surprise_score* score) {
  return guarded_alone(surprise, "surprise", __func__, [&] {
    require_argument(frame, "frame");
    require_argument(score, "score");
    require_struct_size("score", score->struct_size, sizeof *score);
    const Stopwatch whole;
    const SurpriseScore found = surprise->surprise.push(frame->frame);
    surprise->push_ms = float(whole.elapsed_ms());
    surprise->timestamp_ns = frame->frame.timestamp_ns;
    surprise->sequence = frame->frame.sequence;
    surprise->clock = frame->frame.clock;
    const bool is_event = found.is_event(surprise->event_ratio);
    surprise->pushed += 1;
    surprise->events += is_event ? 1 : 0;
    surprise->starts += found.is_start ? 1 : 0;
    const auto side = int32_t(surprise->surprise.encoder()->codes().side);
    write_struct(score, "score",
                 maq_surprise_score{0, side, side, found.bits, found.ratio, is_event ? 1 : 0, found.is_cut ? 1 : 0,
                                    found.is_start ? 1 : 0});
    return MAQ_OK;
  });
}

maq_status maq_surprise_copy_map(const maq_surprise* surprise, float* bits, size_t count) {
  return guarded_alone(surprise, "surprise", __func__, [&] {
    require_argument(bits, "bits");
    const std::vector<float>& map = surprise->surprise.map();
    if (map.empty()) throw ArgumentError("No frame was pushed, so there is no map; push one first.");
    if (count < map.size()) throw ArgumentError("count is ", count, ", but the map has ", map.size(), " cells.");
    std::copy(map.begin(), map.end(), bits);
    return MAQ_OK;
  });
}

maq_status maq_surprise_acquire_rebuilt(maq_surprise* surprise, maq_frame** frame) {
  return guarded_alone(surprise, "surprise", __func__, [&] {
    require_argument(frame, "frame");
    if (surprise->surprise.map().empty()) throw ArgumentError("No frame was pushed, so there is nothing to rebuild.");
    BoundedPool<maq_frame>::Pooled handle = surprise->pictures.acquire();
    const int side_px = surprise->decoder->frame_px();
    Frame& picture = handle->frame;
    picture.clear();
    surprise->decoder->run(surprise->surprise.codes().data(), picture.allocate(MAQ_PIXEL_RGB8, side_px, side_px));
    picture.timestamp_ns = surprise->timestamp_ns;
    picture.sequence = surprise->sequence;
    picture.clock = surprise->clock;
    picture.origin = {true, picture.timestamp_ns, picture.sequence, 0};
    *frame = lend<maq_frame>(std::move(handle));
    return MAQ_OK;
  });
}

maq_status maq_surprise_reset(maq_surprise* surprise) {
  return guarded_alone(surprise, "surprise", __func__, [&] {
    surprise->surprise.reset();
    return MAQ_OK;
  });
}

maq_status maq_surprise_get_stats(const maq_surprise* surprise, maq_surprise_stats* stats) {
  return guarded_alone(surprise, "surprise", __func__, [&] {
    const SurpriseTimes& times = surprise->surprise.times();
    write_struct(stats, "stats",
                 maq_surprise_stats{0, times.encoder.resize_ms, times.encoder.network_ms, times.encoder.nearest_ms,
                                    surprise->push_ms, surprise->surprise.encoder()->threads(), surprise->pushed,
                                    surprise->events, surprise->starts, times.transformer_ms});
    return MAQ_OK;
  });
}
