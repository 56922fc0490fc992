/* Prediction, with or without a check of the camera, as a model of a pipeline (pipeline.h). */
#ifndef MAQUETTE_PREDICTION_MODEL_H_
#define MAQUETTE_PREDICTION_MODEL_H_

#include "maquette/camera_health.h"
#include "maquette/pipeline.h"
#include "maquette/prediction.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Creates a model that predicts the frame `ahead_s` seconds after each frame, 0 to 10. With `checks_camera` 1 it
 * also checks the camera with each frame (camera_health.h). The model copies the settings and shares the networks of
 * `predictor`, which may be destroyed afterwards. Gaps in the source are not concealed (concealer.h). Free `*model`
 * with maq_model_destroy.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_prediction_model_create(maq_context* context, const maq_predictor* predictor, double ahead_s,
                                               int32_t checks_camera, maq_model** model);

/* Returns the frame that was predicted from the frame of a result, marked as predicted (maq_frame_get_origin). Returns
 * NULL if another model ran. It belongs to the result.
 * Any thread. Does not fail or block. */
MAQ_API const maq_frame* maq_pipeline_result_get_predicted_frame(const maq_pipeline_result* result);

/* Gets what camera health found with the frame of a result. The caller sets health->struct_size. There is no map.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT, MAQ_ERROR_NOT_FOUND (the model does not check the camera). Does not
 * block. */
MAQ_API maq_status maq_pipeline_result_get_camera_health(const maq_pipeline_result* result,
                                                         maq_camera_health_result* health);

#ifdef __cplusplus
}
#endif

#endif /* MAQUETTE_PREDICTION_MODEL_H_ */
