#include <cmath>
#include <optional>

#include "api/boundary.h"
#include "api/bundle_argument.h"
#include "api/densepose_handle.h"
#include "api/edges_handle.h"
#include "api/prediction_handles.h"
#include "api/source_handle.h"
#include "maquette/pipeline.h"
#include "pipeline/pipeline.h"

using namespace maq;

namespace {

constexpr uint32_t kDefaultPoolSize = 4, kMaxPoolSize = 64;
constexpr double kMaxFrameBudgetMs = 60000;

// Of the thread that asked, as with maq_last_error.
thread_local std::string given_problem, given_uri;

maq_pipeline_config default_pipeline_config() {
  maq_pipeline_config config{};
  config.struct_size = sizeof config;
  config.result_pool_size = kDefaultPoolSize;
  return config;
}

PipelineModel model_of(const maq_densepose_config* given, const char* name) {
  const maq_densepose_config config = read_densepose_config(given, name);
  const DensePoseSettings settings = densepose_settings(config, name);
  return {bundle_reader(config.model, concatenate(name, ".model").c_str(), kDensePoseBundle), settings, nullptr};
}

PipelineModel model_of(const maq_edges_config* given, const char* name, const maq_edges_curves_config* curves,
                       const char* curves_name) {
  const maq_edges_config config = read_edges_config(given, name);
  LiveEdgesSettings settings{edges_settings(config, name), std::nullopt};
  if (curves != nullptr) settings.curves = curve_request(curves, curves_name);
  return {bundle_reader(config, name, kEdgesBundle), settings, nullptr};
}

// A stream of its own with the settings and the networks of the handles.
PipelineModel model_of(const maq_predictor& predictor, double ahead_s, const maq_surprise* surprise) {
  LivePredictionSettings settings;
  if (predictor.by_network != nullptr) {
    const NetworkPredictor& by_network = *predictor.by_network;
    settings.by_network =
        std::make_unique<NetworkPredictor>(by_network.networks(), by_network.settings(), by_network.threads());
  } else {
    settings.predictor = std::make_unique<Predictor>(predictor.predictor->settings());
  }
  settings.ahead_ns = std::llround(ahead_s * 1e9);
  if (surprise != nullptr) {
    settings.surprise = std::make_unique<Surprise>(surprise->surprise.encoder(), surprise->surprise.transformer());
    settings.event_ratio = surprise->event_ratio;
  }
  return {nullptr, {}, make_live_prediction(std::move(settings))};
}

// The handles of results. A copy has the same pools.
struct ResultPools {
  explicit ResultPools(uint32_t size)
      : frames(size, "frames"),
        densepose(size, "results"),
        edges(size, "results"),
        curves(size, "curves"),
        predicted(size, "predicted frames") {}

  BoundedPool<maq_frame> frames;
  BoundedPool<maq_densepose_result> densepose;
  BoundedPool<maq_edges_result> edges;
  BoundedPool<maq_edges_curves> curves;
  BoundedPool<maq_frame> predicted;
};

// A result of the pipeline in handles of the caller.
struct ResultHandles {
  // Before it is known which model the next result is of. Throws MAQ_ERROR_POOL_EMPTY.
  explicit ResultHandles(const ResultPools& given)
      : pools(given),
        frame(given.frames.acquire()),
        densepose(given.densepose.acquire()),
        edges(given.edges.acquire()),
        curves(given.curves.acquire()),
        predicted(given.predicted.acquire()) {}

  // Memory goes back and forth.
  void swap(PipelineOutput& made) {
    std::swap(densepose->result, made.densepose);
    std::swap(edges->result, made.edges);
    std::swap(curves->found, made.curves);
    std::swap(predicted->frame, made.predicted);
  }

  maq_pipeline_result hand_over(const PipelineOutput& made, const PipelineTimes& times) {
    maq_pipeline_result result{};
    result.struct_size = sizeof result;
    result.number = times.number;
    result.wait_ms = times.wait_ms;
    result.run_ms = times.run_ms;
    result.age_ms = times.age_ms;
    result.frame = lend<maq_frame>(std::move(frame));
    result.surprise_bits = -1;
    switch (made.kind) {
      case LiveModelKind::kDensePose: result.densepose = lend<maq_densepose_result>(std::move(densepose)); break;
      case LiveModelKind::kEdges:
        edges->curves = pools.curves;
        result.edges = lend<maq_edges_result>(std::move(edges));
        if (made.has_curves) result.curves = lend<maq_edges_curves>(std::move(curves));
        break;
      case LiveModelKind::kPrediction:
        result.predicted = lend<maq_frame>(std::move(predicted));
        if (!made.has_surprise) break;
        result.surprise_bits = made.surprise.bits;
        result.surprise_ratio = made.surprise.ratio;
        result.is_event = made.is_event ? 1 : 0;
        result.is_cut = made.surprise.is_cut ? 1 : 0;
        result.is_start = made.surprise.is_start ? 1 : 0;
    }
    return result;
  }

  const ResultPools& pools;
  BoundedPool<maq_frame>::Pooled frame;
  BoundedPool<maq_densepose_result>::Pooled densepose;
  BoundedPool<maq_edges_result>::Pooled edges;
  BoundedPool<maq_edges_curves>::Pooled curves;
  BoundedPool<maq_frame>::Pooled predicted;
};

PipelineSettings pipeline_settings(const maq_pipeline_config& config, const std::shared_ptr<ContextState>& state,
                                   const ResultPools& pools) {
  require_range("config.nice", config.nice, 0, 19);
  require_range("config.frame_budget_ms", config.frame_budget_ms, 0.0, kMaxFrameBudgetMs);
  const maq_source_config source = read_source_config(config.source, "config.source");
  if (source.state_callback != nullptr) {
    throw ArgumentError("config.source.state_callback is not NULL; use config.state_callback.");
  }
  PipelineSettings settings;
  if (config.edges != nullptr && config.densepose != nullptr) {
    throw ArgumentError("config.densepose and config.edges are both given, but a pipeline runs one model.");
  }
  if (config.edges == nullptr && config.curves != nullptr) {
    throw ArgumentError("config.curves is given without config.edges, in which they are found.");
  }
  settings.model = config.edges != nullptr ? model_of(config.edges, "config.edges", config.curves, "config.curves")
                                           : model_of(config.densepose, "config.densepose");
  settings.source = source_settings(source, "config.source", state->log());
  // Those that the app holds, one that waits for it and one that is being mapped.
  settings.source.pool_size = int(config.result_pool_size) + 2;
  settings.nice = config.nice;
  settings.frame_budget_ms = config.frame_budget_ms;
  settings.runtime = [state] { return state->onnxruntime(); };
  if (config.result_callback != nullptr) {
    settings.on_result = [pools = ResultPools(pools), call = config.result_callback,
                          user_data = config.result_user_data](Frame& frame, PipelineOutput& output,
                                                               const PipelineTimes& times) {
      std::optional<ResultHandles> handles;
      try {
        handles.emplace(pools);
      } catch (const Error& error) {
        if (error.status() != MAQ_ERROR_POOL_EMPTY) throw;
        return false;  // the app holds them all
      }
      std::swap(handles->frame->frame, frame);
      handles->swap(output);
      const maq_pipeline_result result = handles->hand_over(output, times);
      call(user_data, &result);
      return true;
    };
  }
  if (config.state_callback != nullptr) {
    settings.on_state = [call = config.state_callback, user_data = config.state_user_data](const PipelineStatus& now) {
      call(user_data, now.state, now.status, now.problem.c_str());
    };
  }
  return settings;
}

}  // namespace

struct maq_pipeline : HandleOf<HandleKind::kPipeline> {
  maq_pipeline(const maq_pipeline_config& config, const std::shared_ptr<ContextState>& state)
      : pools(config.result_pool_size),
        has_callback(config.result_callback != nullptr),
        pipeline(pipeline_settings(config, state, pools)) {}

  ResultPools pools;
  const bool has_callback;
  Pipeline pipeline;
};

maq_status maq_pipeline_config_init(maq_pipeline_config* config, uint32_t struct_size) {
  return init_config(__func__, config, struct_size, default_pipeline_config());
}

maq_status maq_pipeline_create(maq_context* context, const maq_pipeline_config* given, maq_pipeline** pipeline) {
  return guarded(context, __func__, [&] {
    require_argument(context, "context");
    require_argument(given, "config");
    require_argument(pipeline, "pipeline");
    const maq_pipeline_config config = read_config(given, "config", default_pipeline_config());
    require_range("config.result_pool_size", config.result_pool_size, 1u, kMaxPoolSize);
    *pipeline = new maq_pipeline(config, context->state);
    return MAQ_OK;
  });
}

void maq_pipeline_destroy(maq_pipeline* pipeline) { destroy(pipeline, "pipeline", __func__); }

maq_status maq_pipeline_set_source(maq_pipeline* pipeline, const char* uri) {
  return guarded(pipeline, __func__, [&] {
    require_argument(pipeline, "pipeline");
    require_argument(uri, "uri");
    pipeline->pipeline.set_source(uri);
    return MAQ_OK;
  });
}

maq_status maq_pipeline_set_densepose(maq_pipeline* pipeline, const maq_densepose_config* config) {
  return guarded(pipeline, __func__, [&] {
    require_argument(pipeline, "pipeline");
    pipeline->pipeline.set_model(model_of(config, "config"));
    return MAQ_OK;
  });
}

maq_status maq_pipeline_set_edges(maq_pipeline* pipeline, const maq_edges_config* config,
                                  const maq_edges_curves_config* curves) {
  return guarded(pipeline, __func__, [&] {
    require_argument(pipeline, "pipeline");
    pipeline->pipeline.set_model(model_of(config, "config", curves, "curves"));
    return MAQ_OK;
  });
}

maq_status maq_pipeline_set_roll(maq_pipeline* pipeline, float roll_rad) {
  return guarded(pipeline, __func__, [&] {
    require_argument(pipeline, "pipeline");
    pipeline->pipeline.set_roll(require_roll(roll_rad));
    return MAQ_OK;
  });
}

maq_status maq_pipeline_set_prediction(maq_pipeline* pipeline, const maq_predictor* predictor, double ahead_s,
                                       const maq_surprise* surprise) {
  return guarded(pipeline, __func__, [&] {
    require_argument(pipeline, "pipeline");
    require_argument(predictor, "predictor");
    require_range("ahead_s", ahead_s, 0.0, double(Predictor::kMaxAhead_ns) / 1e9);
    if (surprise != nullptr) require_argument(surprise, "surprise");
    pipeline->pipeline.set_model(model_of(*predictor, ahead_s, surprise));
    return MAQ_OK;
  });
}

maq_status maq_pipeline_set_paused(maq_pipeline* pipeline, int32_t is_paused) {
  return guarded(pipeline, __func__, [&] {
    require_argument(pipeline, "pipeline");
    require_range("is_paused", is_paused, 0, 1);
    pipeline->pipeline.set_paused(is_paused == 1);
    return MAQ_OK;
  });
}

maq_status maq_pipeline_set_recording(maq_pipeline* pipeline, const char* path) {
  return guarded(pipeline, __func__, [&] {
    require_argument(pipeline, "pipeline");
    if (path != nullptr && *path == '\0') throw ArgumentError("path is empty; NULL ends a recording.");
    pipeline->pipeline.set_recording(path == nullptr ? "" : path);
    return MAQ_OK;
  });
}

maq_status maq_pipeline_stop(maq_pipeline* pipeline) {
  return guarded(pipeline, __func__, [&] {
    require_argument(pipeline, "pipeline");
    pipeline->pipeline.stop();
    return MAQ_OK;
  });
}

maq_status maq_pipeline_acquire_result(maq_pipeline* pipeline, int64_t timeout_ns, maq_pipeline_result* result) {
  return guarded(pipeline, __func__, [&] {
    require_argument(pipeline, "pipeline");
    require_argument(result, "result");
    require_struct_size("result", result->struct_size, sizeof(maq_pipeline_result));
    if (pipeline->has_callback) {
      throw Error(MAQ_ERROR_UNSUPPORTED, "The pipeline gives its results to config.result_callback.");
    }
    ResultHandles handles(pipeline->pools);
    PipelineOutput output;
    PipelineTimes times;
    handles.swap(output);  // whose memory the pipeline gets for the next one
    const maq_status status = pipeline->pipeline.acquire(timeout_ns, handles.frame->frame, output, times);
    handles.swap(output);
    if (status == MAQ_TIMEOUT) {
      return keep_error(pipeline, status, nullptr,
                        concatenate("No result came within ", timeout_ns / 1000000, " ms.").c_str());
    }
    if (status == MAQ_CANCELLED) {
      return keep_error(pipeline, status, nullptr, "The pipeline is stopped; start it with maq_pipeline_set_source.");
    }
    if (status == MAQ_OK) write_struct(result, "result", handles.hand_over(output, times));
    return status;
  });
}

void maq_pipeline_release_result(maq_pipeline_result* result) {
  if (result == nullptr) return;
  maq_frame_release(std::exchange(result->frame, nullptr));
  maq_densepose_result_release(std::exchange(result->densepose, nullptr));
  maq_edges_result_release(std::exchange(result->edges, nullptr));
  maq_edges_curves_release(std::exchange(result->curves, nullptr));
  maq_frame_release(std::exchange(result->predicted, nullptr));
}

maq_status maq_pipeline_get_info(const maq_pipeline* pipeline, maq_pipeline_info* info) {
  return guarded(pipeline, __func__, [&] {
    require_argument(pipeline, "pipeline");
    PipelineStatus now = pipeline->pipeline.status();
    given_problem = std::move(now.problem);
    given_uri = pipeline->pipeline.source_uri();
    write_struct(info, "info", maq_pipeline_info{0, now.state, now.status, given_problem.c_str(), given_uri.c_str()});
    return MAQ_OK;
  });
}

maq_status maq_pipeline_get_stats(const maq_pipeline* pipeline, maq_pipeline_stats* stats) {
  return guarded(pipeline, __func__, [&] {
    require_argument(pipeline, "pipeline");
    const PipelineStats from = pipeline->pipeline.stats();
    write_struct(stats, "stats",
                 maq_pipeline_stats{0, from.results, from.dropped_results, from.dropped_frames, from.results_per_second,
                                    from.latest.wait_ms, from.latest.run_ms, from.latest.age_ms,
                                    from.effort.key_frame_interval, from.effort.long_side_px});
    return MAQ_OK;
  });
}

maq_status maq_pipeline_get_surface(maq_pipeline* pipeline, maq_densepose_surface* surface) {
  return guarded(pipeline, __func__, [&] {
    require_argument(pipeline, "pipeline");
    require_argument(surface, "surface");
    const SurfaceGrid& grid = pipeline->pipeline.surface();
    write_struct(surface, "surface", maq_densepose_surface{0, grid.nodes, grid.points_m.data()});
    return MAQ_OK;
  });
}
