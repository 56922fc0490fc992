#include <atomic>
#include <functional>
#include <optional>

#include "api/boundary.h"
#include "api/bundle_argument.h"
#include "api/densepose/densepose_handle.h"
#include "api/model_handle.h"
#include "core/clock.h"
#include "densepose/frame_budget.h"
#include "maquette/densepose_model.h"

using namespace maq;

namespace {

constexpr double kMaxFrameBudgetMs = 60000;

struct DensePoseOutput : LiveOutput {
  DensePoseOutput() { handle.set_held(false); }
  void set_held(bool is_held) noexcept override { handle.set_held(is_held); }
  maq_densepose_result handle;
};

class DensePoseModel : public LiveModel {
 public:
  DensePoseModel(std::shared_ptr<ContextState> state, std::function<Bundle()> read_bundle,
                 const DensePoseSettings& settings)
      : state_(std::move(state)), read_bundle_(std::move(read_bundle)), settings_(settings) {}

  void load() override {
    unload();  // before the next networks take memory
    const Bundle bundle = read_bundle_();
    auto loaded = std::make_shared<DensePose>(state_->onnxruntime(), bundle, settings_);
    state_->log().write(MAQ_LOG_INFO, "Bundle ", bundle.manifest.name, " ", bundle.manifest.version, " (",
                        bundle.manifest.precision, ") loaded, ", loaded->threads(), " thread(s)");
    full_ = {loaded->key_frame_interval(), loaded->long_side_px()};
    loaded->number_people_after(last_person_id_);
    std::lock_guard<std::mutex> lock(mutex_);
    densepose_ = std::move(loaded);
    quality_ = full_;
  }

  void unload() noexcept override {
    std::shared_ptr<DensePose> unloaded;
    budget_.reset();
    std::lock_guard<std::mutex> lock(mutex_);
    densepose_.swap(unloaded);
    if (unloaded != nullptr) last_person_id_ = unloaded->last_person_id();
    quality_ = {0, 0};
  }

  void run(const Frame& frame, const maq_intrinsics*, std::unique_ptr<LiveOutput>& output) override {
    const auto begin = MonotonicClock::now();
    densepose_->set_roll(roll_rad_);
    densepose_->run(frame.image, reuse_output<DensePoseOutput>(output).handle.result, {true, frame.timestamp_ns});
    keep_budget(begin);
  }

  void reset() override { densepose_->reset(); }

  void cancel() noexcept override {
    std::lock_guard<std::mutex> lock(mutex_);
    if (densepose_ != nullptr) densepose_->cancel();
  }

  void set_roll(float rad) { roll_rad_ = rad; }
  void set_frame_budget(double budget_ms) { budget_ms_ = budget_ms; }

  DensePoseQuality quality() const {
    std::lock_guard<std::mutex> lock(mutex_);
    return quality_;
  }

  const SurfaceGrid& surface() {
    std::shared_ptr<DensePose> loaded;
    {
      std::lock_guard<std::mutex> lock(mutex_);
      if (surface_) return *surface_;
      loaded = densepose_;
    }
    if (loaded == nullptr) {
      throw Error(MAQ_ERROR_UNSUPPORTED, "The model is not loaded yet; wait for MAQ_PIPELINE_RUNNING.");
    }
    const SurfaceGrid& grid = loaded->surface();
    std::lock_guard<std::mutex> lock(mutex_);
    if (!surface_) surface_ = grid;
    return *surface_;
  }

 private:
  // After a frame.
  void keep_budget(MonotonicClock::time_point begin) {
    const double budget_ms = budget_ms_;
    if (budget_ms != known_budget_ms_ || (budget_ms > 0 && !budget_)) {
      known_budget_ms_ = budget_ms;
      budget_.reset();
      if (budget_ms > 0) budget_.emplace(budget_ms, full_);
      set_quality(full_);
    }
    const auto end = MonotonicClock::now();
    const double run_ms = std::chrono::duration<double, std::milli>(end - begin).count();
    if (!budget_ || !budget_->add(end, run_ms)) return;
    const DensePoseQuality& quality = budget_->quality();
    set_quality(quality);
    state_->log().write(MAQ_LOG_INFO, "A frame took ", run_ms, " ms, of ", budget_ms, ": from now on one key frame in ",
                        quality.key_frame_interval, ", long side ", quality.long_side_px, " px");
  }

  void set_quality(const DensePoseQuality& quality) {
    densepose_->set_quality(quality.key_frame_interval, quality.long_side_px);
    std::lock_guard<std::mutex> lock(mutex_);
    quality_ = quality;
  }

  const std::shared_ptr<ContextState> state_;
  const std::function<Bundle()> read_bundle_;
  const DensePoseSettings settings_;
  std::atomic<float> roll_rad_{0};
  std::atomic<double> budget_ms_{0};

  mutable std::mutex mutex_;              // of what follows to the next line
  std::shared_ptr<DensePose> densepose_;  // the pipeline's thread alone changes it, and runs it
  DensePoseQuality quality_{0, 0};
  std::optional<SurfaceGrid> surface_;

  // The pipeline's thread alone uses these.
  int64_t last_person_id_ = 0;
  DensePoseQuality full_;
  std::optional<FrameBudget> budget_;
  double known_budget_ms_ = 0;
};

DensePoseModel& require_densepose(const maq_model* model) { return require_model<DensePoseModel>(model, "dense pose"); }

}  // namespace

maq_status maq_densepose_model_create(maq_context* context, const maq_densepose_config* given, maq_model** model) {
  return guarded(context, __func__, [&] {
    require_argument(context, "context");
    require_argument(model, "model");
    const maq_densepose_config config = read_densepose_config(given, "config");
    const DensePoseSettings settings = densepose_settings(config, "config");
    *model = new maq_model(std::make_shared<DensePoseModel>(
        context->state, bundle_reader(config.model, "config.model", kDensePoseBundle), settings));
    return MAQ_OK;
  });
}

maq_status maq_densepose_model_set_roll(maq_model* model, float roll_rad) {
  return guarded(model, __func__, [&] {
    require_densepose(model).set_roll(require_roll(roll_rad));
    return MAQ_OK;
  });
}

maq_status maq_densepose_model_set_frame_budget(maq_model* model, double budget_ms) {
  return guarded(model, __func__, [&] {
    DensePoseModel& densepose = require_densepose(model);
    require_range("budget_ms", budget_ms, 0.0, kMaxFrameBudgetMs);
    densepose.set_frame_budget(budget_ms);
    return MAQ_OK;
  });
}

maq_status maq_densepose_model_get_stats(const maq_model* model, maq_densepose_model_stats* stats) {
  return guarded(model, __func__, [&] {
    const DensePoseQuality quality = require_densepose(model).quality();
    write_struct(stats, "stats", maq_densepose_model_stats{0, quality.key_frame_interval, quality.long_side_px});
    return MAQ_OK;
  });
}

maq_status maq_densepose_model_get_surface(maq_model* model, maq_densepose_surface* surface) {
  return guarded(model, __func__, [&] {
    DensePoseModel& densepose = require_densepose(model);
    require_argument(surface, "surface");
    const SurfaceGrid& grid = densepose.surface();
    write_struct(surface, "surface", maq_densepose_surface{0, grid.nodes, grid.points_m.data()});
    return MAQ_OK;
  });
}

const maq_densepose_result* maq_pipeline_result_get_densepose(const maq_pipeline_result* result) {
  return part_of<DensePoseOutput>(
      result, __func__, [](DensePoseOutput& output) -> const maq_densepose_result* { return &output.handle; });
}
