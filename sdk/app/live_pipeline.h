// A pipeline (maquette/pipeline.h) for programs with a window: suitable options, another source if one cannot be
// opened, and messages for the user. Used as LiveDensePose or LiveEdges, which set the model. LivePlayer is the common
// interface with LivePrediction.
#pragma once

#include <atomic>
#include <functional>
#include <maquette/maquette.hpp>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

namespace maquette {

// A file's path as a URI (maquette/source.h); a URI stays as it is.
std::string source_uri(const std::string& path_or_uri);

struct LiveStatus {
  maq_pipeline_state state = MAQ_PIPELINE_STOPPED;
  std::string uri;         // what plays
  std::string activity;    // "Opening v4l2:/dev/video0"; "" when results come or nothing is to be done
  std::string problem;     // a sentence: the reason why no results come, or the failed action
  bool has_ended = false;  // no more results: a photo, the end of a clip, max_results, or has_failed
  bool has_failed = false;
  uint64_t dropped_frames = 0;
  std::vector<maq_pipeline_state> states;  // of the source, in order
};

struct LiveOptions {
  bool real_time = true;     // clips and stubs play at their own pace and begin anew; else as fast as the model runs
  uint64_t max_results = 0;  // 0: no end
  int32_t reconnect_ms = 86400000;  // how long a lost camera is waited for
  int32_t max_side_px = 2048;       // larger images of files are made smaller
  int32_t nice = 5;                 // so that the thread that draws goes first
  double frame_budget_ms = 0;       // of dense pose (maq_densepose_model_set_frame_budget)
};

// These return at once, unless they say otherwise; errors are in status().
class LivePlayer {
 public:
  virtual ~LivePlayer() = default;

  // Plays a source in place of the present one. `fallback`: source to play if it cannot be opened; the reason stays in
  // `problem`.
  virtual void open(const std::string& uri, const std::string& fallback) = 0;
  virtual void close() = 0;  // so that others can open the source
  virtual void set_paused(bool is_paused) = 0;
  // Begins a recording of the source (.maqrec), or ends it with "".
  virtual void set_recording(const std::string& path) = 0;
  virtual LiveStatus status() const = 0;
};

class LivePipeline : public LivePlayer {
 public:
  // The pipeline's thread calls `on_result` with each result and the results a second. It calls `on_change`, which may
  // be null, with each change of the status. Neither may throw or destroy this.
  LivePipeline(const Context& context, const Model& model, std::function<void(PipelineResult, double)> on_result,
               std::function<void()> on_change, const LiveOptions& options);
  ~LivePipeline() override;
  LivePipeline(const LivePipeline&) = delete;
  LivePipeline& operator=(const LivePipeline&) = delete;

  void open(const std::string& uri, const std::string& fallback = "") override;
  void close() override;  // the device is free when the model's run is done
  void set_paused(bool is_paused) override { pipeline_->set_paused(is_paused); }
  void set_recording(const std::string& path) override { pipeline_->set_recording(path); }
  LiveStatus status() const override;

 protected:
  Pipeline& pipeline() { return *pipeline_; }
  const Pipeline& pipeline() const { return *pipeline_; }

 private:
  void take_result(PipelineResult result);
  void take_state(maq_pipeline_state state, const char* problem);
  bool falls_back(maq_pipeline_state now) const {
    return now == MAQ_PIPELINE_FAILED && !is_open_ && !fallback_.empty();
  }

  const std::function<void(PipelineResult, double)> on_result_;
  const std::function<void()> on_change_;
  const uint64_t max_results_;
  std::atomic<uint64_t> result_count_{0};

  mutable std::mutex mutex_;  // of what follows to the next line
  std::string uri_, fallback_, fallback_reason_;
  bool is_open_ = false;     // the source was opened
  bool is_awaited_ = false;  // no state of the source was reported yet
  std::vector<maq_pipeline_state> states_;

  std::optional<Pipeline> pipeline_;  // last: its callbacks use the others
};

}  // namespace maquette
