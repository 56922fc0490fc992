#include "pipeline/live_model.h"

#include "core/error.h"

namespace maq {
namespace {

class LiveDensePose : public LiveModel {
 public:
  LiveDensePose(std::shared_ptr<const OnnxRuntimeLibrary> runtime, const Bundle& bundle,
                const DensePoseSettings& settings)
      : densepose_(std::move(runtime), bundle, settings) {}

  void run(const Frame& frame, const maq_intrinsics*, PipelineOutput& output) override {
    densepose_.run(frame.image, output.densepose);
    output.kind = LiveModelKind::kDensePose;
  }
  void set_roll(float rad) override { densepose_.set_roll(rad); }
  void cancel() noexcept override { densepose_.cancel(); }
  void forget() override { densepose_.reset(); }
  int threads() const override { return densepose_.threads(); }
  FrameEffort effort() const override { return {densepose_.key_frame_interval(), densepose_.long_side_px()}; }
  void set_effort(const FrameEffort& effort) override {
    densepose_.set_effort(effort.key_frame_interval, effort.long_side_px);
  }
  const SurfaceGrid& surface() override { return densepose_.surface(); }

 private:
  DensePose densepose_;
};

class LiveEdges : public LiveModel {
 public:
  LiveEdges(std::shared_ptr<const OnnxRuntimeLibrary> runtime, Bundle bundle, const LiveEdgesSettings& settings)
      : edges_(std::move(runtime), std::move(bundle), settings.edges), curves_(settings.curves) {}

  void run(const Frame& frame, const maq_intrinsics* camera, PipelineOutput& output) override {
    if (camera == nullptr && depth_of(frame) != nullptr) {
      throw Error(MAQ_ERROR_UNSUPPORTED,
                  "The source does not say how its camera maps directions to pixels, from which lengths come; add the "
                  "horizontal field of view in degrees to its URI, or focal lengths in pixels: fov=60, fx=380&fy=380.");
    }
    // What has no depth is refused there, with or without a camera.
    edges_.run(frame, camera == nullptr ? maq_intrinsics{} : *camera, output.edges);
    if (curves_) finder_.find(output.edges.field, *curves_, output.curves);
    output.kind = LiveModelKind::kEdges;
    output.has_curves = curves_.has_value();
  }
  void cancel() noexcept override { edges_.cancel(); }
  int threads() const override { return edges_.threads(); }

 private:
  Edges edges_;
  std::optional<CurveRequest> curves_;
  CurveFinder finder_;
};

class LivePredictor : public LiveModel {
 public:
  explicit LivePredictor(LivePredictionSettings settings) : stream_(std::move(settings)) {}

  void run(const Frame& frame, const maq_intrinsics*, PipelineOutput& output) override {
    if (stream_.by_network != nullptr) {
      stream_.by_network->push(frame);
      stream_.by_network->predict(stream_.ahead_ns, output.predicted);
    } else {
      stream_.predictor->push(frame);
      stream_.predictor->predict(stream_.ahead_ns, output.predicted);
    }
    output.kind = LiveModelKind::kPrediction;
    output.has_surprise = stream_.surprise != nullptr;
    if (!output.has_surprise) return;
    output.surprise = stream_.surprise->push(frame);
    output.is_event = output.surprise.is_event(stream_.event_ratio);
  }
  void forget() override {
    stream_.by_network != nullptr ? stream_.by_network->reset() : stream_.predictor->reset();
    if (stream_.surprise != nullptr) stream_.surprise->reset();
  }

 private:
  LivePredictionSettings stream_;
};

}  // namespace

const SurfaceGrid& LiveModel::surface() {
  throw Error(MAQ_ERROR_UNSUPPORTED, "The model of the pipeline has no body surface; dense pose has.");
}

std::shared_ptr<LiveModel> make_live_model(std::shared_ptr<const OnnxRuntimeLibrary> runtime, Bundle bundle,
                                           const PipelineModel& model) {
  if (const auto* const edges = std::get_if<LiveEdgesSettings>(&model.settings)) {
    return std::make_shared<LiveEdges>(std::move(runtime), std::move(bundle), *edges);
  }
  return std::make_shared<LiveDensePose>(std::move(runtime), bundle, std::get<DensePoseSettings>(model.settings));
}

std::shared_ptr<LiveModel> make_live_prediction(LivePredictionSettings settings) {
  return std::make_shared<LivePredictor>(std::move(settings));
}

}  // namespace maq
