/* Edges, with or without curves, as a model of a pipeline (pipeline.h). */
#ifndef MAQUETTE_EDGES_MODEL_H_
#define MAQUETTE_EDGES_MODEL_H_

#include "maquette/edge_curves.h"
#include "maquette/edges.h"
#include "maquette/pipeline.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Creates a model that finds edges in frames with depth of a source that gives its intrinsics (source.h). The pipeline
 * loads the bundle later. `config` may be NULL for the defaults. `curves`: options of the curves, which are found too;
 * NULL: no curves are found. Both are copied. config->result_pool_size is the number of curve objects that
 * maq_edges_result_find_curves may lend. Free `*model` with maq_model_destroy.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_edges_model_create(maq_context* context, const maq_edges_config* config,
                                          const maq_edges_curves_config* curves, maq_model** model);

/* Returns the edges in the frame of a result, or NULL if another model ran. They belong to the result.
 * Any thread. Does not fail or block. */
MAQ_API const maq_edges_result* maq_pipeline_result_get_edges(const maq_pipeline_result* result);

/* Returns the curves in the frame of a result, or NULL if the model finds none. They belong to the result.
 * Any thread. Does not fail or block. */
MAQ_API const maq_edges_curves* maq_pipeline_result_get_curves(const maq_pipeline_result* result);

#ifdef __cplusplus
}
#endif

#endif /* MAQUETTE_EDGES_MODEL_H_ */
