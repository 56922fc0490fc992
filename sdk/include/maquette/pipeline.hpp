// Live results of a source, for C++17; a part of maquette.hpp.
#ifndef MAQUETTE_PIPELINE_HPP_
#define MAQUETTE_PIPELINE_HPP_

#include <memory>
#include <optional>
#include <string>

#include "maquette/frame.hpp"
#include "maquette/pipeline.h"

namespace maquette {

inline maq_pipeline_config default_pipeline_config() {
  maq_pipeline_config config;
  check(maq_pipeline_config_init(&config, sizeof config));
  return config;
}

// The model that a pipeline runs. Derived: DensePoseModel, EdgesModel, PredictionModel.
class Model {
 public:
  maq_model* get() const { return owner_.get(); }

 protected:
  Model() = default;
  void own(maq_model* made) { owner_.reset(made); }

 private:
  Owner<maq_model, maq_model_destroy> owner_;
};

// A result of a pipeline with its frame. Functions beside the models return their outputs (densepose_of). Frame and
// outputs share the result, which is released with the last of them.
class PipelineResult {
 public:
  // Takes over a result of a callback or of the C API.
  explicit PipelineResult(maq_pipeline_result* result)
      : owner_(result, maq_pipeline_result_release), frame(part(maq_pipeline_result_get_frame(result))) {
    maq_pipeline_result_stats stats{};
    stats.struct_size = sizeof stats;
    check(maq_pipeline_result_get_stats(result, &stats));
    number = stats.number;
    wait_ms = stats.wait_ms;
    run_ms = stats.run_ms;
    age_ms = stats.age_ms;
  }

  maq_pipeline_result* get() const { return owner_.get(); }

  // A handle that belongs to the result.
  template <class Handle>
  PartOf<Handle> part(const Handle* handle) const {
    return {handle, owner_};
  }

 private:
  std::shared_ptr<maq_pipeline_result> owner_;

 public:
  Frame frame;
  uint64_t number = 0;
  double wait_ms = 0, run_ms = 0, age_ms = -1;
};

class Pipeline {
 public:
  Pipeline(const Context& context, const maq_pipeline_config& config) {
    maq_pipeline* made = nullptr;
    check(maq_pipeline_create(context.get(), &config, &made));
    owner_.reset(made);
  }
  explicit Pipeline(const Context& context) : Pipeline(context, default_pipeline_config()) {}

  maq_pipeline* get() const { return owner_.get(); }

  void set_source(const std::string& uri) { check(maq_pipeline_set_source(get(), uri.c_str())); }
  void set_model(const Model& model) { check(maq_pipeline_set_model(get(), model.get())); }
  // Results have a frame only.
  void remove_model() { check(maq_pipeline_set_model(get(), nullptr)); }
  void set_paused(bool is_paused) { check(maq_pipeline_set_paused(get(), is_paused ? 1 : 0)); }
  // "" ends the recording.
  void set_recording(const std::string& path) {
    check(maq_pipeline_set_recording(get(), path.empty() ? nullptr : path.c_str()));
  }
  void stop() { check(maq_pipeline_stop(get())); }

  // Returns nothing after the last frame. Throws Error with MAQ_TIMEOUT if no result came in time.
  std::optional<PipelineResult> next(int64_t timeout_ns = MAQ_WAIT_FOREVER) {
    maq_pipeline_result* result = nullptr;
    const maq_status status = maq_pipeline_acquire_result(get(), timeout_ns, &result);
    if (status == MAQ_END_OF_STREAM) return std::nullopt;
    check(status);
    return PipelineResult(result);
  }

  // The texts stay valid until this thread calls info() again.
  maq_pipeline_info info() const {
    maq_pipeline_info info{};
    info.struct_size = sizeof info;
    check(maq_pipeline_get_info(get(), &info));
    return info;
  }

  maq_pipeline_stats stats() const {
    maq_pipeline_stats stats{};
    stats.struct_size = sizeof stats;
    check(maq_pipeline_get_stats(get(), &stats));
    return stats;
  }

 private:
  Owner<maq_pipeline, maq_pipeline_destroy> owner_;
};

}  // namespace maquette

#endif  // MAQUETTE_PIPELINE_HPP_
