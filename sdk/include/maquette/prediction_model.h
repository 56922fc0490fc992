/* Prediction, with or without novelty, as a model of a pipeline (pipeline.h). */
#ifndef MAQUETTE_PREDICTION_MODEL_H_
#define MAQUETTE_PREDICTION_MODEL_H_

#include "maquette/novelty.h"
#include "maquette/pipeline.h"
#include "maquette/prediction.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Creates a model that predicts the frame `ahead_s` seconds after each frame, 0 to 10. It also scores the novelty of
 * each frame, unless `novelty` is NULL. The model copies the settings and shares the networks of `predictor` and
 * `novelty`; both may be destroyed afterwards. Gaps in the source are not concealed (concealer.h). Free `*model` with
 * maq_model_destroy.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_prediction_model_create(maq_context* context, const maq_predictor* predictor, double ahead_s,
                                               const maq_novelty* novelty, maq_model** model);

/* Returns the frame that was predicted from the frame of a result, marked as predicted (maq_frame_get_origin). Returns
 * NULL if another model ran. It belongs to the result.
 * Any thread. Does not fail or block. */
MAQ_API const maq_frame* maq_pipeline_result_get_predicted_frame(const maq_pipeline_result* result);

/* Gets the novelty score of the frame of a result. The caller sets score->struct_size. The score has no map: columns
 * and rows are 0. Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT, MAQ_ERROR_NOT_FOUND (the model does not score
 * novelty). Does not block. */
MAQ_API maq_status maq_pipeline_result_get_novelty(const maq_pipeline_result* result, maq_novelty_score* score);

#ifdef __cplusplus
}
#endif

#endif /* MAQUETTE_PREDICTION_MODEL_H_ */
