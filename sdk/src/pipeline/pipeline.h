// A source and a model on a thread of their own: the newest frame wins, and callers never wait for either.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "core/frame.h"
#include "densepose/surface_grid.h"
#include "maquette/pipeline.h"
#include "nn/onnxruntime_library.h"
#include "pipeline/frame_budget.h"
#include "pipeline/live_model.h"
#include "sources/source.h"

namespace maq {

// As in maq_pipeline_result.
struct PipelineTimes {
  uint64_t number = 0;
  double wait_ms = 0;
  double run_ms = 0;
  double age_ms = -1;
};

// As in maq_pipeline_info.
struct PipelineStatus {
  maq_pipeline_state state = MAQ_PIPELINE_STOPPED;
  maq_status status = MAQ_OK;
  std::string problem;
};

// As in maq_pipeline_stats.
struct PipelineStats {
  uint64_t results = 0;
  uint64_t dropped_results = 0;
  uint64_t dropped_frames = 0;
  double results_per_second = 0;
  PipelineTimes latest;
  FrameEffort effort{0, 0};  // of the next frame
};

struct PipelineSettings {
  PipelineModel model;
  SourceSettings source;  // on_state is not used
  int nice = 0;
  double frame_budget_ms = 0;                                          // 0: none; of dense pose alone
  std::function<std::shared_ptr<const OnnxRuntimeLibrary>()> runtime;  // on the thread, before a model is loaded
  // Called on the thread; may call every function of the pipeline. `on_result` takes what it wants to keep out of its
  // arguments by swapping, and returns false when the result is dropped; without it results wait for acquire().
  std::function<bool(Frame&, PipelineOutput&, const PipelineTimes&)> on_result;
  std::function<void(const PipelineStatus&)> on_state;
};

// Every function may be called from any thread; none waits for the source or the model. maquette/pipeline.h says more.
class Pipeline {
 public:
  explicit Pipeline(PipelineSettings settings);
  // Stops, and waits for the step that runs, but not for a device that hangs while it is opened. Also from a callback.
  ~Pipeline();

  void set_source(const std::string& uri);
  void set_model(const PipelineModel& model);
  void set_paused(bool is_paused);
  void set_roll(float rad);                     // DensePose::set_roll() of this model and later ones
  void set_recording(const std::string& path);  // "": ends it
  // Returns when no callback runs, unless it is called by one.
  void stop();

  // Swaps the newest result with the arguments. MAQ_OK, MAQ_TIMEOUT, MAQ_END_OF_STREAM or MAQ_CANCELLED; throws the
  // failure of the pipeline.
  maq_status acquire(int64_t timeout_ns, Frame& frame, PipelineOutput& output, PipelineTimes& times);

  PipelineStatus status() const;
  std::string source_uri() const;
  PipelineStats stats() const;
  // Of the model that was loaded last; stays as long as the pipeline. Throws MAQ_ERROR_UNSUPPORTED,
  // MAQ_ERROR_BAD_BUNDLE.
  const SurfaceGrid& surface();

 private:
  struct State;

  std::shared_ptr<State> state_;
};

}  // namespace maq
