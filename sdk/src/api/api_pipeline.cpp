#include <optional>

#include "api/boundary.h"
#include "api/model_handle.h"
#include "api/source_handle.h"
#include "maquette/pipeline.h"
#include "pipeline/pipeline.h"

using namespace maq;

namespace {

constexpr uint32_t kDefaultPoolSize = 4, kMaxPoolSize = 64;

using ResultPool = BoundedPool<maq_pipeline_result>;

maq_pipeline_config default_pipeline_config() {
  maq_pipeline_config config{};
  config.struct_size = sizeof config;
  return config;
}

uint32_t pool_size(const maq_pipeline_config& config) {
  return config.result_pool_size != 0 ? config.result_pool_size : kDefaultPoolSize;
}

// Hands the result with its parts over to the app.
maq_pipeline_result* lend_result(ResultPool::Pooled result, const PipelineTimes& times) {
  result->times = times;
  result->frame.set_held(true);
  if (result->output != nullptr) result->output->set_held(true);
  return lend<maq_pipeline_result>(std::move(result));
}

void return_result(maq_pipeline_result* result) {
  result->frame.set_held(false);
  result->frame.frame.clear();
  if (result->output != nullptr) result->output->set_held(false);
  return_to_pool<maq_pipeline_result>(result);
}

PipelineSettings pipeline_settings(const maq_pipeline_config& config, const std::shared_ptr<ContextState>& state,
                                   const ResultPool& results) {
  require_range("config.nice", config.nice, 0, 19);
  const maq_source_config source = read_source_config(config.source, "config.source");
  if (source.state_callback != nullptr) {
    throw ArgumentError("config.source.state_callback is not NULL; use config.state_callback.");
  }
  PipelineSettings settings;
  settings.source = source_settings(source, "config.source", state->log());
  // Frames that the app holds, one that waits for it and one that is being processed.
  settings.source.pool_size = int(pool_size(config)) + 2;
  settings.nice = config.nice;
  if (config.result_callback != nullptr) {
    settings.on_result = [results, call = config.result_callback, user_data = config.result_user_data](
                             Frame& frame, std::unique_ptr<LiveOutput>& output, const PipelineTimes& times) {
      ResultPool::Pooled result;
      try {
        result = results.acquire();
      } catch (const Error& error) {
        if (error.status() != MAQ_ERROR_POOL_EMPTY) throw;
        return false;  // the app holds them all
      }
      std::swap(result->frame.frame, frame);
      result->output.swap(output);
      maq_pipeline_result* const lent = lend_result(std::move(result), times);
      call_app("config.result_callback", [&] { call(user_data, lent); });
      return true;
    };
  }
  if (config.state_callback != nullptr) {
    settings.on_state = [call = config.state_callback, user_data = config.state_user_data](const PipelineStatus& now) {
      call_app("config.state_callback", [&] { call(user_data, now.state, now.status, now.problem.c_str()); });
    };
  }
  return settings;
}

}  // namespace

struct maq_pipeline : HandleOf<HandleKind::kPipeline> {
  maq_pipeline(const maq_pipeline_config& config, const std::shared_ptr<ContextState>& state)
      : results(pool_size(config), "results"),
        has_callback(config.result_callback != nullptr),
        pipeline(pipeline_settings(config, state, results)) {}

  const ResultPool results;
  const bool has_callback;
  Pipeline pipeline;
};

void maq_model_destroy(maq_model* model) { destroy(model, "model", __func__); }

maq_status maq_pipeline_config_init(maq_pipeline_config* config, uint32_t struct_size) {
  return init_config(__func__, config, struct_size, default_pipeline_config());
}

maq_status maq_pipeline_create(maq_context* context, const maq_pipeline_config* given, maq_pipeline** pipeline) {
  return guarded(context, __func__, [&] {
    require_argument(context, "context");
    require_argument(pipeline, "pipeline");
    const maq_pipeline_config config = read_config(given, "config", default_pipeline_config());
    require_range("config.result_pool_size", config.result_pool_size, 0u, kMaxPoolSize);
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

maq_status maq_pipeline_set_model(maq_pipeline* pipeline, maq_model* model) {
  return guarded(pipeline, __func__, [&] {
    require_argument(pipeline, "pipeline");
    if (model != nullptr) require_argument(model, "model");
    pipeline->pipeline.set_model(model != nullptr ? model->model : nullptr);
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

maq_status maq_pipeline_acquire_result(maq_pipeline* pipeline, int64_t timeout_ns, maq_pipeline_result** result) {
  return guarded(pipeline, __func__, [&] {
    require_argument(pipeline, "pipeline");
    require_argument(result, "result");
    if (pipeline->has_callback) {
      throw Error(MAQ_ERROR_UNSUPPORTED, "The pipeline gives its results to config.result_callback.");
    }
    ResultPool::Pooled taken = pipeline->results.acquire();
    PipelineTimes times;
    // The pipeline gets the memory of the result for the next one.
    const maq_status status = pipeline->pipeline.acquire(timeout_ns, taken->frame.frame, taken->output, times);
    if (status == MAQ_TIMEOUT) {
      return keep_error(pipeline, status, nullptr,
                        concatenate("No result came within ", timeout_ns / 1000000, " ms.").c_str());
    }
    if (status == MAQ_CANCELLED) {
      return keep_error(pipeline, status, nullptr, "The pipeline is stopped; start it with maq_pipeline_set_source.");
    }
    if (status == MAQ_OK) *result = lend_result(std::move(taken), times);
    return status;
  });
}

void maq_pipeline_result_release(maq_pipeline_result* result) {
  return_handle(result, "result", __func__, return_result);
}

const maq_frame* maq_pipeline_result_get_frame(const maq_pipeline_result* result) {
  const maq_frame* frame = nullptr;
  if (result == nullptr) return frame;
  guarded(result, __func__, [&] {
    require_argument(result, "result");
    frame = &result->frame;
    return MAQ_OK;
  });
  return frame;
}

maq_status maq_pipeline_result_get_stats(const maq_pipeline_result* result, maq_pipeline_result_stats* stats) {
  return guarded(result, __func__, [&] {
    require_argument(result, "result");
    const PipelineTimes& from = result->times;
    write_struct(stats, "stats", maq_pipeline_result_stats{0, from.number, from.wait_ms, from.run_ms, from.age_ms});
    return MAQ_OK;
  });
}

maq_status maq_pipeline_get_info(const maq_pipeline* pipeline, maq_pipeline_info* info) {
  return guarded(pipeline, __func__, [&] {
    require_argument(pipeline, "pipeline");
    PipelineStatus now = pipeline->pipeline.status();
    ThreadTexts* const texts = thread_texts();
    if (texts == nullptr) throw std::bad_alloc();
    texts->pipeline_problem = std::move(now.problem);
    texts->pipeline_uri = pipeline->pipeline.source_uri();
    write_struct(
        info, "info",
        maq_pipeline_info{0, now.state, now.status, texts->pipeline_problem.c_str(), texts->pipeline_uri.c_str()});
    return MAQ_OK;
  });
}

maq_status maq_pipeline_get_stats(const maq_pipeline* pipeline, maq_pipeline_stats* stats) {
  return guarded(pipeline, __func__, [&] {
    require_argument(pipeline, "pipeline");
    const PipelineStats from = pipeline->pipeline.stats();
    write_struct(stats, "stats",
                 maq_pipeline_stats{0, from.results, from.dropped_results, from.dropped_frames, from.results_per_second,
                                    from.latest.wait_ms, from.latest.run_ms, from.latest.age_ms});
    return MAQ_OK;
  });
}
