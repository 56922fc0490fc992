// Edges as a model of a pipeline, for C++17; a part of maquette.hpp.
#ifndef MAQUETTE_EDGES_MODEL_HPP_
#define MAQUETTE_EDGES_MODEL_HPP_

#include <optional>

#include "maquette/edges.hpp"
#include "maquette/edges_model.h"
#include "maquette/pipeline.hpp"

namespace maquette {

class EdgesModel : public Model {
 public:
  // `curves` null: no curves are found.
  explicit EdgesModel(const Context& context, const maq_edges_config& config = default_edges_config(),
                      const maq_edges_curves_config* curves = nullptr) {
    maq_model* made = nullptr;
    check(maq_edges_model_create(context.get(), &config, curves, &made));
    own(made);
  }
};

// Nothing if another model ran.
inline std::optional<EdgesResult> edges_of(const PipelineResult& result) {
  const maq_edges_result* const edges = maq_pipeline_result_get_edges(result.get());
  if (edges == nullptr) return std::nullopt;
  return EdgesResult(result.part(edges));
}

// Nothing if the model finds no curves.
inline std::optional<EdgesCurves> curves_of(const PipelineResult& result) {
  const maq_edges_curves* const curves = maq_pipeline_result_get_curves(result.get());
  if (curves == nullptr) return std::nullopt;
  return EdgesCurves(result.part(curves));
}

}  // namespace maquette

#endif  // MAQUETTE_EDGES_MODEL_HPP_
