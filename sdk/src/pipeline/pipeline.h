// Runs a source and a model on one thread: the newest frame wins, and callers wait for neither.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "core/frame.h"
#include "maquette/pipeline.h"
#include "pipeline/live_model.h"
#include "sources/source.h"

namespace maq {

// See maq_pipeline_result_stats.
struct PipelineTimes {
  uint64_t number = 0;
  double wait_ms = 0;
  double run_ms = 0;
  double age_ms = -1;
};

// See maq_pipeline_info.
struct PipelineStatus {
  maq_pipeline_state state = MAQ_PIPELINE_STOPPED;
  maq_status status = MAQ_OK;
  std::string problem;
};

// See maq_pipeline_stats.
struct PipelineStats {
  uint64_t results = 0;
  uint64_t dropped_results = 0;
  uint64_t dropped_frames = 0;
  double results_per_second = 0;
  PipelineTimes latest;
};

struct PipelineSettings {
  SourceSettings source;  // on_state is not used
  int nice = 0;
  // The thread calls these; they may call every function of the pipeline. `on_result` swaps frame and output out of its
  // arguments, and returns false if the result is dropped. Without it, results wait for acquire().
  std::function<bool(Frame&, std::unique_ptr<LiveOutput>&, const PipelineTimes&)> on_result;
  std::function<void(const PipelineStatus&)> on_state;
};

// Any thread may call every function; none waits for the source or the model. maquette/pipeline.h describes them.
class Pipeline {
 public:
  explicit Pipeline(PipelineSettings settings);
  // Stops, and waits for the current step, but not for a device that hangs while it is opened. Also from a callback.
  ~Pipeline();

  void set_source(const std::string& uri);
  // nullptr: no model runs. Throws the errors of LiveModel::use_for().
  void set_model(const std::shared_ptr<LiveModel>& model);
  void set_paused(bool is_paused);
  void set_recording(const std::string& path);  // "": ends the recording
  // Returns when no callback runs, unless it is called by one.
  void stop();

  // Swaps the newest result with the arguments. Returns MAQ_OK, MAQ_TIMEOUT, MAQ_END_OF_STREAM or MAQ_CANCELLED; throws
  // the failure of the pipeline.
  maq_status acquire(int64_t timeout_ns, Frame& frame, std::unique_ptr<LiveOutput>& output, PipelineTimes& times);

  PipelineStatus status() const;
  std::string source_uri() const;
  PipelineStats stats() const;

 private:
  struct State;

  std::shared_ptr<State> state_;
};

}  // namespace maq
