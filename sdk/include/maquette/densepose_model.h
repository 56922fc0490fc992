/* Dense pose as a model of a pipeline (pipeline.h). */
#ifndef MAQUETTE_DENSEPOSE_MODEL_H_
#define MAQUETTE_DENSEPOSE_MODEL_H_

#include "maquette/densepose.h"
#include "maquette/pipeline.h"

#ifdef __cplusplus
extern "C" {
#endif

/* The quality in use: the values of the config, or less within a frame budget. */
typedef struct maq_densepose_model_stats {
  uint32_t struct_size;
  int32_t key_frame_interval; /* 0 before the model is loaded */
  int32_t long_side_px;       /* 0 before the model is loaded; with an automatic size, its smaller value */
} maq_densepose_model_stats;

/* Creates a model that runs dense pose. The pipeline loads the bundle later. `config` may be NULL for the defaults. It
 * is copied; result_pool_size is not used. Free `*model` with maq_model_destroy.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_densepose_model_create(maq_context* context, const maq_densepose_config* config,
                                              maq_model** model);

/* Sets the roll of the camera for the next frames (maq_densepose_set_roll).
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_densepose_model_set_roll(maq_model* model, float roll_rad);

/* Limits the mean time that dense pose takes for a frame of a stream, for devices that throttle. `budget_ms`: up to
 * 60000; 0 (at first): no limit. If frames take longer, people are detected in every 2nd and then every 4th frame, and
 * an automatic size becomes its smaller value. After that, long_side_px falls in steps of 32 pixels, to no less than
 * half. When frames have taken less time for some
 * seconds, both values return step by step.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_densepose_model_set_frame_budget(maq_model* model, double budget_ms);

/* Gets the quality in use. The caller sets stats->struct_size.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_densepose_model_get_stats(const maq_model* model, maq_densepose_model_stats* stats);

/* Gets the surface that the bundle's labels refer to (maq_densepose_get_surface), once the model is loaded. The points
 * belong to `model` and live as long as it does.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT, MAQ_ERROR_UNSUPPORTED (the model is not loaded, or its bundle has no
 * surface), MAQ_ERROR_BAD_BUNDLE (the surface is damaged). Blocks briefly the first time, while the surface is
 * decoded. */
MAQ_API maq_status maq_densepose_model_get_surface(maq_model* model, maq_densepose_surface* surface);

/* Returns the people in the frame of a result, or NULL if another model ran. They belong to the result.
 * Any thread. Does not fail or block. */
MAQ_API const maq_densepose_result* maq_pipeline_result_get_densepose(const maq_pipeline_result* result);

#ifdef __cplusplus
}
#endif

#endif /* MAQUETTE_DENSEPOSE_MODEL_H_ */
