// Live results of a source, for C++17; a part of maquette.hpp.
#ifndef MAQUETTE_PIPELINE_HPP_
#define MAQUETTE_PIPELINE_HPP_

#include <optional>
#include <string>

#include "maquette/densepose.hpp"
#include "maquette/edges.hpp"
#include "maquette/pipeline.h"
#include "maquette/prediction.hpp"

namespace maquette {

inline maq_pipeline_config default_pipeline_config() {
  maq_pipeline_config config;
  check(maq_pipeline_config_init(&config, sizeof config));
  return config;
}

// A result of a pipeline with its frame.
struct PipelineResult {
  // Takes over what a callback or the C API gives.
  explicit PipelineResult(const maq_pipeline_result& result)
      : frame(result.frame),
        densepose(result.densepose),
        number(result.number),
        wait_ms(result.wait_ms),
        run_ms(result.run_ms),
        age_ms(result.age_ms),
        surprise_bits(result.surprise_bits),
        surprise_ratio(result.surprise_ratio),
        is_event(result.is_event != 0),
        is_cut(result.is_cut != 0),
        is_start(result.is_start != 0) {
    if (result.curves != nullptr) curves.emplace(result.curves);
    if (result.edges != nullptr) edges.emplace(result.edges);
    if (result.predicted != nullptr) predicted.emplace(result.predicted);
  }

  Frame frame;
  DensePoseResult densepose;          // get() is null where another model runs
  std::optional<EdgesResult> edges;   // nothing where another model runs
  std::optional<EdgesCurves> curves;  // nothing where they were not asked for
  std::optional<Frame> predicted;     // nothing where another model runs
  uint64_t number;
  double wait_ms, run_ms, age_ms;
  float surprise_bits, surprise_ratio;  // bits: -1 where surprise was not asked for
  bool is_event, is_cut, is_start;      // of surprise
};

class Pipeline {
 public:
  Pipeline(const Context& context, const maq_pipeline_config& config) {
    maq_pipeline* made = nullptr;
    check(maq_pipeline_create(context.get(), &config, &made));
    owner_.reset(made);
  }

  maq_pipeline* get() const { return owner_.get(); }

  void set_source(const std::string& uri) { check(maq_pipeline_set_source(get(), uri.c_str())); }
  void set_densepose(const maq_densepose_config& config) { check(maq_pipeline_set_densepose(get(), &config)); }
  // Edges in place of the current model; without curves where `curves` is null.
  void set_edges(const maq_edges_config& config, const maq_edges_curves_config* curves = nullptr) {
    check(maq_pipeline_set_edges(get(), &config, curves));
  }
  void set_roll(float roll_rad) { check(maq_pipeline_set_roll(get(), roll_rad)); }
  // What comes, and surprise unless it is null: with the settings and networks of these.
  void set_prediction(const Predictor& predictor, double ahead_s, const Surprise* surprise = nullptr) {
    check(
        maq_pipeline_set_prediction(get(), predictor.get(), ahead_s, surprise != nullptr ? surprise->get() : nullptr));
  }
  void set_paused(bool is_paused) { check(maq_pipeline_set_paused(get(), is_paused ? 1 : 0)); }
  // "" ends the recording.
  void set_recording(const std::string& path) {
    check(maq_pipeline_set_recording(get(), path.empty() ? nullptr : path.c_str()));
  }
  void stop() { check(maq_pipeline_stop(get())); }

  // Nothing after the last frame. Throws Error with MAQ_TIMEOUT when no result came in time.
  std::optional<PipelineResult> next(int64_t timeout_ns = MAQ_WAIT_FOREVER) {
    maq_pipeline_result result{};
    result.struct_size = sizeof result;
    const maq_status status = maq_pipeline_acquire_result(get(), timeout_ns, &result);
    if (status == MAQ_END_OF_STREAM) return std::nullopt;
    check(status);
    return PipelineResult(result);
  }

  // Its texts stay until this thread asks again.
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

  // Nothing before a model is loaded, or when its bundle has none. The points are this object's.
  std::optional<maq_densepose_surface> surface() const {
    maq_densepose_surface surface{};
    surface.struct_size = sizeof surface;
    const maq_status status = maq_pipeline_get_surface(get(), &surface);
    if (status == MAQ_ERROR_UNSUPPORTED) return std::nullopt;
    check(status);
    return surface;
  }

 private:
  Owner<maq_pipeline, maq_pipeline_destroy> owner_;
};

}  // namespace maquette

#endif  // MAQUETTE_PIPELINE_HPP_
