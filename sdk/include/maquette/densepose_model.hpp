// Dense pose as a model of a pipeline, for C++17; a part of maquette.hpp.
#ifndef MAQUETTE_DENSEPOSE_MODEL_HPP_
#define MAQUETTE_DENSEPOSE_MODEL_HPP_

#include <optional>

#include "maquette/densepose.hpp"
#include "maquette/densepose_model.h"
#include "maquette/pipeline.hpp"

namespace maquette {

class DensePoseModel : public Model {
 public:
  explicit DensePoseModel(const Context& context, const maq_densepose_config& config = default_densepose_config()) {
    maq_model* made = nullptr;
    check(maq_densepose_model_create(context.get(), &config, &made));
    own(made);
  }

  // From any thread.
  void set_roll(float roll_rad) { check(maq_densepose_model_set_roll(get(), roll_rad)); }
  // From any thread; 0: no limit.
  void set_frame_budget(double budget_ms) { check(maq_densepose_model_set_frame_budget(get(), budget_ms)); }

  maq_densepose_model_stats stats() const {
    maq_densepose_model_stats stats{};
    stats.struct_size = sizeof stats;
    check(maq_densepose_model_get_stats(get(), &stats));
    return stats;
  }

  // Returns nothing before the model is loaded, or if its bundle has no surface. The points belong to this object.
  std::optional<maq_densepose_surface> surface() const {
    maq_densepose_surface surface{};
    surface.struct_size = sizeof surface;
    const maq_status status = maq_densepose_model_get_surface(get(), &surface);
    if (status == MAQ_ERROR_UNSUPPORTED) return std::nullopt;
    check(status);
    return surface;
  }
};

// get() is null if another model ran.
inline DensePoseResult densepose_of(const PipelineResult& result) {
  return DensePoseResult(result.part(maq_pipeline_result_get_densepose(result.get())));
}

}  // namespace maquette

#endif  // MAQUETTE_DENSEPOSE_MODEL_HPP_
