// What a pipeline runs on each frame: dense pose, edges with their curves, or what comes next and surprise.
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
#include "prediction/networks/network_predictor.h"
#include "prediction/predictor.h"
#include "prediction/surprise/surprise.h"

namespace maq {

struct LiveEdgesSettings {
  EdgesSettings edges;
  std::optional<CurveRequest> curves;  // nothing: the field alone
};

class LiveModel;

struct PipelineModel {
  std::function<Bundle()> read_bundle;  // on the thread
  std::variant<DensePoseSettings, LiveEdgesSettings> settings;
  std::shared_ptr<LiveModel> made;  // instead of these, where no bundle is to be read
};

// A stream's own, of one pipeline; networks may be shared.
struct LivePredictionSettings {
  std::unique_ptr<Predictor> predictor;          // or:
  std::unique_ptr<NetworkPredictor> by_network;  // one of these
  int64_t ahead_ns = 0;
  std::unique_ptr<Surprise> surprise;  // null: not found
  float event_ratio = 0;
};

enum class LiveModelKind { kDensePose, kEdges, kPrediction };

// Of one of the models; the rest is as it was.
struct PipelineOutput {
  DensePoseResult densepose;
  EdgesResult edges;
  FoundCurves curves;
  Frame predicted;
  SurpriseScore surprise;
  LiveModelKind kind = LiveModelKind::kDensePose;
  bool has_curves = false, has_surprise = false, is_event = false;
};

class LiveModel {
 public:
  virtual ~LiveModel() = default;

  // `camera`: of the source, nullptr where it does not say. Memory of `output` is reused.
  virtual void run(const Frame& frame, const maq_intrinsics* camera, PipelineOutput& output) = 0;
  virtual void set_roll(float /*rad*/) {}    // of the next frames' pictures
  virtual void cancel() noexcept {}          // from any thread
  virtual void forget() {}                   // the source before
  virtual int threads() const { return 0; }  // in use, of what has a bundle
  // What it does for a frame; of a model that cannot do less, 0 and 0.
  virtual FrameEffort effort() const { return {0, 0}; }
  virtual void set_effort(const FrameEffort&) {}
  // Throws MAQ_ERROR_UNSUPPORTED where labels refer to no surface.
  virtual const SurfaceGrid& surface();
};

std::shared_ptr<LiveModel> make_live_model(std::shared_ptr<const OnnxRuntimeLibrary> runtime, Bundle bundle,
                                           const PipelineModel& model);
std::shared_ptr<LiveModel> make_live_prediction(LivePredictionSettings settings);

}  // namespace maq
