/* Prediction: what a stream will show next. */
#ifndef MAQUETTE_PREDICTION_H_
#define MAQUETTE_PREDICTION_H_

#include "maquette/frame.h"

#ifdef __cplusplus
extern "C" {
#endif

/* A predictor gets the frames of a stream as they come and makes pictures of what it will show a while later: to hide
 * the time that a picture takes from the camera to the screen, or to bridge a camera that stalls. It sees pictures, not
 * the world: never steer anything by what it made up. maq_frame_get_origin tells its frames from a camera's. */

typedef struct maq_predictor maq_predictor;

/* Values never change meaning; new ones are added at the end. */
typedef enum maq_prediction_method {
  MAQ_PREDICTION_AUTO = 0,  /* whichever of the others was right about the frames that have come, at that time ahead;
                               the last frame where they tie, and while nothing moves */
  MAQ_PREDICTION_LAST = 1,  /* the last frame, repeated */
  MAQ_PREDICTION_MOTION = 2 /* everything moves on as it moved between the last two frames */
} maq_prediction_method;

typedef struct maq_predictor_config {
  uint32_t struct_size;
  int32_t threads;              /* 1 to 64; 0 (default): the machine's large cores, at most 4 */
  maq_prediction_method method; /* default MAQ_PREDICTION_AUTO */
  uint32_t frame_pool_size;     /* predicted frames the app may hold at once, 1 to 64; default 4 */
} maq_predictor_config;

/* Times of the latest push and prediction, in wall-clock milliseconds, and counts since the predictor was made. */
typedef struct maq_predictor_stats {
  uint32_t struct_size;
  float grey_ms;                /* of the latest push: the frame copied, and its brightness at several sizes */
  float flow_ms;                /* its motion since the frame before */
  float choice_ms;              /* which method was right about it (MAQ_PREDICTION_AUTO) */
  float push_ms;                /* all of it */
  float project_ms;             /* of the latest prediction: where each pixel comes from */
  float fetch_ms;               /* its pixels */
  float predict_ms;             /* all of it */
  maq_prediction_method method; /* of the latest prediction: MAQ_PREDICTION_LAST or MAQ_PREDICTION_MOTION */
  uint64_t pushed_count;
  uint64_t predicted_count;
  uint64_t reset_count; /* frames that did not go on from the one before, so that it was forgotten */
} maq_predictor_stats;

/* Fills `config` with the defaults and sets struct_size. `struct_size` is sizeof(maq_predictor_config) of the caller.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_predictor_config_init(maq_predictor_config* config, uint32_t struct_size);

/* Makes a predictor for one stream. `config` may be NULL for the defaults. `*predictor` is the caller's, to be given to
 * maq_predictor_destroy.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_predictor_create(maq_context* context, const maq_predictor_config* config,
                                        maq_predictor** predictor);

/* Frees the predictor (NULL is fine). Frames that it made stay valid until they are released.
 * Once for each predictor, from any thread. May block briefly. */
MAQ_API void maq_predictor_destroy(maq_predictor* predictor);

/* Shows the stream's next frame to the predictor. It is copied: release it at any time. Time counts by the frames'
 * timestamps, so that frames may be missing. The frames before are forgotten where this one is of another size, format
 * or clock, not later than they are or more than a second later, or shows something else (a cut); one of the same time
 * as the frame before replaces it.
 * One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT, MAQ_ERROR_UNSUPPORTED (a depth image). Blocks while motion is
 * found. */
MAQ_API maq_status maq_predictor_push(maq_predictor* predictor, const maq_frame* frame);

/* Makes the picture that the stream will show `ahead_s` seconds after the latest frame, 0 to 10, in that frame's size
 * and format, with that time as its timestamp and that frame's sequence. While one frame is known, and while nothing
 * moves, it is that frame. `*frame` comes from a pool of frame_pool_size: give it back with maq_frame_release.
 * One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT (also before the first frame), MAQ_ERROR_POOL_EMPTY. Blocks while
 * pixels are computed. */
MAQ_API maq_status maq_predictor_predict(maq_predictor* predictor, double ahead_s, maq_frame** frame);

/* Forgets the frames so far, as before another stream.
 * One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_predictor_reset(maq_predictor* predictor);

/* Gets times and counts. The caller sets stats->struct_size.
 * One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_predictor_get_stats(const maq_predictor* predictor, maq_predictor_stats* stats);

#ifdef __cplusplus
}
#endif

#endif /* MAQUETTE_PREDICTION_H_ */
