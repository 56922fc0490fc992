#include <functional>
#include <optional>

#include "api/boundary.h"
#include "api/bundle_argument.h"
#include "api/edges/edges_handle.h"
#include "api/model_handle.h"
#include "maquette/edges_model.h"

using namespace maq;

namespace {

struct EdgesOutput : LiveOutput {
  EdgesOutput() {
    edges.set_held(false);
    curves.set_held(false);
  }
  void set_held(bool is_held) noexcept override {
    edges.set_held(is_held);
    curves.set_held(is_held && has_curves);
  }
  maq_edges_result edges;
  maq_edges_curves curves;
  bool has_curves = false;
};

class EdgesModel : public LiveModel {
 public:
  EdgesModel(std::shared_ptr<ContextState> state, std::function<Bundle()> read_bundle, const EdgesSettings& settings,
             const std::optional<CurveRequest>& curves, uint32_t pool_size)
      : state_(std::move(state)),
        read_bundle_(std::move(read_bundle)),
        settings_(settings),
        curves_(curves),
        pool_(pool_size, "curves") {}

  void load() override {
    unload();  // before the next networks take memory
    Bundle bundle = read_bundle_();
    const Manifest manifest = bundle.manifest;
    auto loaded = std::make_shared<Edges>(state_->onnxruntime(), std::move(bundle), settings_);
    state_->log().write(MAQ_LOG_INFO, "Bundle ", manifest.name, " ", manifest.version, " (", manifest.precision,
                        ") loaded, ", loaded->threads(), " thread(s)");
    std::lock_guard<std::mutex> lock(mutex_);
    edges_ = std::move(loaded);
  }

  void unload() noexcept override {
    std::shared_ptr<Edges> unloaded;
    std::lock_guard<std::mutex> lock(mutex_);
    edges_.swap(unloaded);
  }

  void run(const Frame& frame, const maq_intrinsics*, std::unique_ptr<LiveOutput>& output) override {
    auto& found = reuse_output<EdgesOutput>(output);
    edges_->run(frame, found.edges.result);
    found.edges.curves = pool_;
    found.has_curves = curves_.has_value();
    if (curves_) finder_.find(found.edges.result.field, *curves_, found.curves.found);
  }

  void cancel() noexcept override {
    std::lock_guard<std::mutex> lock(mutex_);
    if (edges_ != nullptr) edges_->cancel();
  }

 private:
  const std::shared_ptr<ContextState> state_;
  const std::function<Bundle()> read_bundle_;
  const EdgesSettings settings_;
  const std::optional<CurveRequest> curves_;
  const BoundedPool<maq_edges_curves> pool_;  // of maq_edges_result_find_curves
  std::mutex mutex_;                          // of the next line
  std::shared_ptr<Edges> edges_;              // the pipeline's thread alone changes it, and runs it
  CurveFinder finder_;
};

}  // namespace

maq_status maq_edges_model_create(maq_context* context, const maq_edges_config* given,
                                  const maq_edges_curves_config* curves, maq_model** model) {
  return guarded(context, __func__, [&] {
    require_argument(context, "context");
    require_argument(model, "model");
    const maq_edges_config config = read_edges_config(given, "config");
    const EdgesSettings settings = edges_settings(config, "config");
    std::optional<CurveRequest> request;
    if (curves != nullptr) request = curve_request(curves, "curves");
    *model = new maq_model(std::make_shared<EdgesModel>(context->state,
                                                        bundle_reader(config.model, "config.model", kEdgesBundle),
                                                        settings, request, result_pool_size_of(config)));
    return MAQ_OK;
  });
}

const maq_edges_result* maq_pipeline_result_get_edges(const maq_pipeline_result* result) {
  return part_of<EdgesOutput>(result, __func__,
                              [](EdgesOutput& output) -> const maq_edges_result* { return &output.edges; });
}

const maq_edges_curves* maq_pipeline_result_get_curves(const maq_pipeline_result* result) {
  return part_of<EdgesOutput>(result, __func__, [](EdgesOutput& output) -> const maq_edges_curves* {
    return output.has_curves ? &output.curves : nullptr;
  });
}
