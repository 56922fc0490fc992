#include <algorithm>

#include "api/boundary.h"
#include "api/bundle_argument.h"
#include "api/model_options.h"
#include "api/prediction/prediction_handles.h"
#include "core/clock.h"
#include "core/worker_threads.h"

using namespace maq;

namespace {

constexpr char kNoveltyBundle[] = "prediction-int8";
constexpr float kDefaultEventRatio = 4, kMaxEventRatio = 1e6f;

maq_novelty_config default_novelty_config() {
  maq_novelty_config config{};
  config.struct_size = sizeof config;
  return config;
}

float event_ratio_of(const maq_novelty_config& config) {
  if (config.event_ratio == 0) return kDefaultEventRatio;
  if (config.event_ratio > 1 && config.event_ratio <= kMaxEventRatio) return config.event_ratio;
  throw ArgumentError("config.event_ratio is ", config.event_ratio,
                      ", but must be above 1, and at most 1e6; 0 is the default.");
}

NoveltyNetworks open_networks(ContextState& state, const maq_novelty_config& config) {
  require_model_options("config.model", config.model);
  SessionSettings settings;
  settings.threads = config.model.threads != 0 ? config.model.threads : default_threads();
  settings.provider = config.model.provider;
  const CodeBundle bundle(read_bundle_argument(config.model, "config.model", kNoveltyBundle));
  NoveltyNetworks networks;
  networks.encoder = std::make_shared<FrameEncoder>(state.onnxruntime(), bundle, settings);
  settings.threads = networks.encoder->threads();
  networks.decoder = std::make_shared<FrameDecoder>(state.onnxruntime(), bundle, settings);
  if (config.method == MAQ_NOVELTY_AUTO && TransformerBundle::is_in(bundle)) {
    networks.transformer = std::make_shared<CodeTransformer>(state.onnxruntime(), bundle, settings);
  }
  const Manifest& manifest = bundle.bundle.manifest;
  state.log().write(MAQ_LOG_INFO, "Bundle ", manifest.name, " ", manifest.version, " (", manifest.precision,
                    ") loaded, ", settings.threads, " thread(s)");
  return networks;
}

NoveltyNetworks adopt_networks(const maq_novelty_config& config) {
  require_argument(config.shared_with, "config.shared_with");
  const maq_novelty& other = *config.shared_with;
  NoveltyNetworks networks{other.novelty.encoder(), other.decoder, other.novelty.transformer()};
  if (config.method == MAQ_NOVELTY_BIGRAM) networks.transformer = nullptr;
  return networks;
}

}  // namespace

maq_status maq_novelty_config_init(maq_novelty_config* config, uint32_t struct_size) {
  return init_config(__func__, config, struct_size, default_novelty_config());
}

maq_status maq_novelty_create(maq_context* context, const maq_novelty_config* given, maq_novelty** novelty) {
  return guarded(context, __func__, [&] {
    require_argument(context, "context");
    require_argument(novelty, "novelty");
    const maq_novelty_config config = read_config(given, "config", default_novelty_config());
    require_range("config.method", number_in(config.method), int32_t(MAQ_NOVELTY_AUTO), int32_t(MAQ_NOVELTY_BIGRAM));
    const float event_ratio = event_ratio_of(config);
    NoveltyNetworks networks =
        config.shared_with != nullptr ? adopt_networks(config) : open_networks(*context->state, config);
    *novelty = new maq_novelty(context->state, std::move(networks), event_ratio);
    return MAQ_OK;
  });
}

void maq_novelty_destroy(maq_novelty* novelty) { destroy(novelty, "novelty", __func__); }

maq_status maq_novelty_push(maq_novelty* novelty, const maq_frame* frame, maq_novelty_score* score) {
  return guarded_alone(novelty, "novelty", __func__, [&] {
    require_argument(frame, "frame");
    require_argument(score, "score");
    require_struct_size("score", score->struct_size, sizeof *score);
    const Stopwatch whole;
    const NoveltyScore found = novelty->novelty.push(frame->frame);
    novelty->push_ms = float(whole.elapsed_ms());
    novelty->timestamp_ns = frame->frame.timestamp_ns;
    novelty->sequence = frame->frame.sequence;
    novelty->clock = frame->frame.clock;
    const bool is_event = found.is_event(novelty->event_ratio);
    novelty->pushed += 1;
    novelty->events += is_event ? 1 : 0;
    novelty->starts += found.is_stream_start ? 1 : 0;
    const auto side = int32_t(novelty->novelty.encoder()->codes().side);
    write_struct(score, "score",
                 maq_novelty_score{0, side, side, found.bits, found.ratio, is_event ? 1 : 0, found.is_cut ? 1 : 0,
                                   found.is_stream_start ? 1 : 0});
    return MAQ_OK;
  });
}

maq_status maq_novelty_copy_map(const maq_novelty* novelty, float* bits, size_t capacity) {
  return guarded_alone(novelty, "novelty", __func__, [&] {
    require_argument(bits, "bits");
    const std::vector<float>& map = novelty->novelty.map();
    if (map.empty()) throw ArgumentError("No frame was pushed, so there is no map; push one first.");
    if (capacity < map.size()) {
      throw ArgumentError("capacity is ", capacity, ", but the map has ", map.size(), " cells.");
    }
    std::copy(map.begin(), map.end(), bits);
    return MAQ_OK;
  });
}

maq_status maq_novelty_acquire_reconstruction(maq_novelty* novelty, maq_frame** frame) {
  return guarded_alone(novelty, "novelty", __func__, [&] {
    require_argument(frame, "frame");
    if (novelty->novelty.map().empty()) {
      throw ArgumentError("No frame was pushed, so there is nothing to reconstruct; push one first.");
    }
    BoundedPool<maq_frame>::Pooled handle = novelty->reconstructions.acquire();
    const int side_px = novelty->decoder->frame_px();
    Frame& image = handle->frame;
    image.clear();
    novelty->decoder->decode(novelty->novelty.codes().data(), image.allocate(MAQ_PIXEL_RGB8, side_px, side_px));
    image.timestamp_ns = novelty->timestamp_ns;
    image.sequence = novelty->sequence;
    image.clock = novelty->clock;
    image.origin = {true, image.timestamp_ns, image.sequence, 0};
    *frame = lend<maq_frame>(std::move(handle));
    return MAQ_OK;
  });
}

maq_status maq_novelty_reset(maq_novelty* novelty) {
  return guarded_alone(novelty, "novelty", __func__, [&] {
    novelty->novelty.reset();
    return MAQ_OK;
  });
}

maq_status maq_novelty_get_stats(const maq_novelty* novelty, maq_novelty_stats* stats) {
  return guarded_alone(novelty, "novelty", __func__, [&] {
    const NoveltyTimes& times = novelty->novelty.times();
    write_struct(stats, "stats",
                 maq_novelty_stats{0, times.encoder.resize_ms, times.encoder.network_ms, times.encoder.nearest_ms,
                                   times.transformer_ms, novelty->push_ms, novelty->novelty.encoder()->threads(),
                                   novelty->pushed, novelty->events, novelty->starts});
    return MAQ_OK;
  });
}
