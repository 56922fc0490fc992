#include "app/live_pipeline.h"

#include <filesystem>
#include <utility>

namespace maquette {
namespace {

constexpr size_t kMaxStates = 1000;
constexpr uint32_t kResultsHeld = 6;

}  // namespace

std::string source_uri(const std::string& path_or_uri) {
  std::error_code error;
  if (!std::filesystem::exists(path_or_uri, error) && path_or_uri.find(':') != std::string::npos) return path_or_uri;
  std::string uri = "file:";
  for (const char c : path_or_uri) uri += c == '?' ? "%3F" : c == '%' ? "%25" : std::string(1, c);
  return uri;
}

LivePipeline::LivePipeline(const Context& context, const Model& model,
                           std::function<void(PipelineResult, double)> on_result, std::function<void()> on_change,
                           const LiveOptions& options)
    : on_result_(std::move(on_result)), on_change_(std::move(on_change)), max_results_(options.max_results) {
  maq_source_config source = default_source_config();
  source.reconnect_ms = options.reconnect_ms;
  source.real_time = source.loop = options.real_time ? 1 : 0;
  source.max_side_px = options.max_side_px;
  maq_pipeline_config config = default_pipeline_config();
  config.source = &source;
  config.result_pool_size = kResultsHeld;
  config.nice = options.nice;
  config.result_user_data = config.state_user_data = this;
  config.result_callback = [](void* self, maq_pipeline_result* result) {
    static_cast<LivePipeline*>(self)->take_result(PipelineResult(result));
  };
  config.state_callback = [](void* self, maq_pipeline_state state, maq_status, const char* problem) {
    static_cast<LivePipeline*>(self)->take_state(state, problem);
  };
  pipeline_.emplace(context, config);
  pipeline_->set_model(model);
}

// Here, so that no callback runs when other members go. By the C function, which does not throw.
LivePipeline::~LivePipeline() { maq_pipeline_stop(pipeline_->get()); }

void LivePipeline::open(const std::string& uri, const std::string& fallback) {
  std::lock_guard<std::mutex> lock(mutex_);
  uri_ = uri;
  fallback_ = fallback;
  fallback_reason_.clear();
  is_open_ = false;
  is_awaited_ = true;
  states_.clear();
  pipeline_->set_source(uri);
}

void LivePipeline::close() {
  pipeline_->stop();
  std::lock_guard<std::mutex> lock(mutex_);
  uri_.clear(), fallback_.clear(), fallback_reason_.clear();
  states_.clear();
}

void LivePipeline::take_result(PipelineResult result) {
  if (max_results_ != 0 && result_count_ >= max_results_) return;
  on_result_(std::move(result), pipeline_->stats().results_per_second);
  if (++result_count_ != max_results_) return;
  pipeline_->set_paused(true);
  if (on_change_) on_change_();
}

void LivePipeline::take_state(maq_pipeline_state state, const char* problem) {
  {
    std::lock_guard<std::mutex> lock(mutex_);
    // Reports are queued: the last ones of the source before may come after open().
    if (is_awaited_ && state != MAQ_PIPELINE_OPENING && state != pipeline_->info().state) return;
    is_awaited_ = false;
    if (state == MAQ_PIPELINE_LOADING || state == MAQ_PIPELINE_RUNNING) is_open_ = true;
    if (states_.size() < kMaxStates) states_.push_back(state);
    if (falls_back(pipeline_->info().state)) {
      uri_ = std::exchange(fallback_, "");
      fallback_reason_ = problem;
      pipeline_->set_source(uri_);
    }
  }
  if (on_change_) on_change_();
}

LiveStatus LivePipeline::status() const {
  const maq_pipeline_info info = pipeline_->info();
  std::lock_guard<std::mutex> lock(mutex_);
  LiveStatus status;
  status.state = info.state;
  status.uri = uri_;
  status.states = states_;
  status.dropped_frames = pipeline_->stats().dropped_frame_count;
  if (info.state == MAQ_PIPELINE_OPENING) status.activity = "Opening " + uri_;
  if (info.state == MAQ_PIPELINE_LOADING) status.activity = "Loading the model";
  status.problem = info.status == MAQ_OK ? fallback_reason_ : info.problem;
  const bool has_all = max_results_ != 0 && result_count_ >= max_results_;
  // A clip that is damaged ends before its last frame.
  status.has_failed = (info.state == MAQ_PIPELINE_FAILED && !falls_back(info.state)) ||
                      (info.state == MAQ_PIPELINE_ENDED && info.status == MAQ_ERROR_UNREADABLE);
  status.has_ended = status.has_failed || has_all || info.state == MAQ_PIPELINE_ENDED;
  return status;
}

}  // namespace maquette
