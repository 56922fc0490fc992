// What a pipeline runs on each frame: dense pose, or edges with their curves.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <variant>

#include "core/frame.h"
#include "densepose/densepose.h"
#include "edges/edges.h"
#include "edges/measuring/curve_finder.h"
#include "nn/bundle.h"
#include "nn/onnxruntime_library.h"
#include "pipeline/frame_budget.h"

namespace maq {

struct LiveEdgesSettings {
  EdgesSettings edges;
  std::optional<CurveRequest> curves;  // nothing: the field alone
};

struct PipelineModel {
  std::function<Bundle()> read_bundle;  // on the thread
  std::variant<DensePoseSettings, LiveEdgesSettings> settings;
};

// Of one of the models; the rest is as it was.
struct PipelineOutput {
  DensePoseResult densepose;
  EdgesResult edges;
  FoundCurves curves;
  bool is_edges = false, has_curves = false;
};

class LiveModel {
 public:
  virtual ~LiveModel() = default;

  // `camera`: of the source, nullptr where it does not say. Memory of `output` is reused.
  virtual void run(const Frame& frame, const maq_intrinsics* camera, PipelineOutput& output) = 0;
  virtual void set_roll(float /*rad*/) {}  // of the next frames' pictures
  virtual void cancel() noexcept = 0;      // from any thread
  virtual void forget() {}                 // the source before
  virtual int threads() const = 0;         // in use
  // What it does for a frame; of a model that cannot do less, 0 and 0.
  virtual FrameEffort effort() const { return {0, 0}; }
  virtual void set_effort(const FrameEffort&) {}
  // Throws MAQ_ERROR_UNSUPPORTED where labels refer to no surface.
  virtual const SurfaceGrid& surface();
};

std::shared_ptr<LiveModel> make_live_model(std::shared_ptr<const OnnxRuntimeLibrary> runtime, Bundle bundle,
                                           const PipelineModel& model);

}  // namespace maq
