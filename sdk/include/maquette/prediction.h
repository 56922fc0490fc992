/* Prediction: the frames that a stream will show next. */
#ifndef MAQUETTE_PREDICTION_H_
#define MAQUETTE_PREDICTION_H_

#include "maquette/frame.h"

#ifdef __cplusplus
extern "C" {
#endif

/* A predictor takes the frames of a stream and predicts later ones. An app shows predicted frames to hide the delay
 * between camera and screen, or to bridge a camera that stalls. Predicted frames are guesses: never steer anything by
 * them. maq_frame_get_origin tells predicted frames from captured ones.
 *
 *   maq_predictor_create(context, NULL, &predictor);
 *   maq_predictor_push(predictor, frame);             // each frame of the stream
 *   maq_predictor_predict(predictor, 0.1, &later);    // the frame 0.1 s after the newest one
 *
 * The networks of SAMPLED divide a frame into cells. They describe each cell by a few codes, which are entries of a
 * codebook. */
typedef struct maq_predictor maq_predictor;

/* How frames are predicted. Values never change meaning; new ones are added at the end. */
typedef enum maq_predictor_method {
  MAQ_PREDICTOR_AUTO = 0,   /* blends LAST and MOTION in each block of pixels, weighted by their errors on past frames
                               at the same time ahead. Equals LAST while errors are unknown or nothing moves. */
  MAQ_PREDICTOR_LAST = 1,   /* repeats the last frame */
  MAQ_PREDICTOR_MOTION = 2, /* each pixel continues its motion between the last two frames */
  MAQ_PREDICTOR_SAMPLED = 3 /* a transformer samples one possible future, in steps of at most 0.1 s, and changes AUTO
                               by it. For research: errors are larger than those of AUTO. Slow; needed for
                               maq_predictor_sample. Not for concealers. */
} maq_predictor_method;

/* Options. 0 is the default in every field; `model` has its own (types.h). */
typedef struct maq_predictor_config {
  uint32_t struct_size;
  maq_model_options model;     /* `threads` applies to each method (MAQ_THREADS_MEASURED is not supported). Other fields
                                  apply to SAMPLED. Default bundle: share/maquette/models/prediction-int8, installed
                                  with the library. */
  maq_predictor_method method; /* default MAQ_PREDICTOR_AUTO */
  uint32_t frame_pool_size;    /* predicted frames the app may hold at once, 1 to 64; 0 (default): 4 */
  float temperature; /* SAMPLED: 0 (default) takes the likeliest code; 1 samples by the probabilities; larger values
                        vary more */
  uint64_t seed;     /* SAMPLED: equal seeds give equal frames on one processor; default 0 */
  const maq_predictor* shared_with; /* shares the networks of this predictor, which samples, too. `model` then sets
                                       only the threads for pixels. The two predictors run their networks one after the
                                       other. Either may be destroyed first. Default NULL: own networks */
} maq_predictor_config;

/* Wall-clock milliseconds of the latest calls, and counts since the predictor was created. */
typedef struct maq_predictor_stats {
  uint32_t struct_size;
  float luma_ms;                /* latest push: the luma pyramid of the frame */
  float flow_ms;                /* latest push: optical flow from the frame before */
  float weights_ms;             /* latest push: blend weights (AUTO, SAMPLED) */
  float push_ms;                /* latest push: total without networks */
  float project_ms;             /* latest prediction: the flow projected to the later time */
  float warp_ms;                /* latest prediction: pixels warped along the flow */
  float predict_ms;             /* latest prediction: total without networks */
  float networks_ms;            /* latest push, prediction or sampling: the networks; 0: none ran, as nothing moved */
  maq_predictor_method method;  /* the method that made the latest prediction. AUTO reports LAST or MOTION when one made
                                   the whole frame. */
  float motion_fraction;        /* latest prediction: mean share of MOTION, 0 to 1, before networks changed it */
  uint64_t pushed_count;        /* pushed frames */
  uint64_t predicted_count;     /* predicted frames */
  uint64_t reset_count;         /* number of frames that did not continue the stream */
  uint32_t sampled_frame_count; /* frames of all samples in the latest prediction or maq_predictor_sample */
  uint32_t step_count;          /* decoding steps for these frames: one per cell, for all samples at once */
  uint32_t cell_count;          /* cells of maq_predictor_copy_entropy_map: 256 with the SDK's bundle, in 16 rows of 16;
                                   0 unless the method is SAMPLED */
} maq_predictor_stats;

/* Fills `config` with the defaults and sets struct_size. `struct_size` is sizeof(maq_predictor_config) of the caller.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_predictor_config_init(maq_predictor_config* config, uint32_t struct_size);

/* Creates a predictor for one stream. `config` may be NULL for the defaults. Free `*predictor` with
 * maq_predictor_destroy. Predictors of one context share scratch memory; each adds one frame plus about 1 MB (at 640 x
 * 480 pixels). SAMPLED loads a bundle of the task "prediction" and checks its files.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT; with networks also MAQ_ERROR_NOT_FOUND, MAQ_ERROR_BAD_BUNDLE,
 * MAQ_ERROR_UNSUPPORTED (another task, or no network for the method), MAQ_ERROR_RUNTIME_LIBRARY. Blocks while files are
 * read. */
MAQ_API maq_status maq_predictor_create(maq_context* context, const maq_predictor_config* config,
                                        maq_predictor** predictor);

/* Frees the predictor (NULL is fine). Predicted frames stay valid until they are released.
 * Once for each predictor, from any thread. May block briefly. */
MAQ_API void maq_predictor_destroy(maq_predictor* predictor);

/* Adds the stream's next frame. The frame is copied, so the app may release it at any time. Motion is computed from
 * timestamps, so frames may be missing. Earlier frames are forgotten at a cut, at another size, format or clock, at an
 * earlier time, and after more than a second. A frame with the newest frame's timestamp replaces it.
 * One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT, MAQ_ERROR_UNSUPPORTED (a depth image), MAQ_ERROR_INFERENCE. Blocks
 * while the motion is computed and a network runs. */
MAQ_API maq_status maq_predictor_push(maq_predictor* predictor, const maq_frame* frame);

/* Predicts the frame `ahead_s` seconds after the newest one, 0 to 10, in the same size and format. Its timestamp is
 * that time; its sequence is the newest frame's. The prediction shows the newest frame while only one frame is known or
 * nothing moves. `*frame` comes from a pool of frame_pool_size: give it back with maq_frame_release.
 * One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT (also before the first frame), MAQ_ERROR_POOL_EMPTY,
 * MAQ_ERROR_INFERENCE, MAQ_CANCELLED. Blocks while pixels are computed and networks run. */
MAQ_API maq_status maq_predictor_predict(maq_predictor* predictor, double ahead_s, maq_frame** frame);

/* Samples `sample_count` (1 to 16) possible futures of `frame_count` (1 to 64) frames, `step_s` seconds apart: above 0,
 * at most 0.125. Steps above 0.1 count as 0.1, the longest in training. The config's temperature and seed apply.
 * Each sample is autoregressive: its frames follow from its own earlier frames. Results depend only on the seed and the
 * pushed frames, not on the counts. While nothing moves, all samples equal the last frame. Samples are valid until the
 * next push, predict, sample or reset.
 * One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT (also before the first frame), MAQ_ERROR_UNSUPPORTED (the method is
 * not SAMPLED), MAQ_ERROR_INFERENCE, MAQ_CANCELLED. Blocks while networks run. Several samples in one call take less
 * time than in several calls. */
MAQ_API maq_status maq_predictor_sample(maq_predictor* predictor, uint32_t sample_count, uint32_t frame_count,
                                        double step_s);

/* Cancels the running maq_predictor_sample or maq_predictor_predict, or else the next call that samples. It returns
 * MAQ_CANCELLED after the current cell. Only the method SAMPLED can be cancelled.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_predictor_cancel(maq_predictor* predictor);

/* Decodes frame `frame_index` (1-based) of sample `sample_index` (0-based) of the latest maq_predictor_sample.
 * Otherwise like maq_predictor_predict.
 * One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT (also for a frame that was not sampled), MAQ_ERROR_UNSUPPORTED (the
 * method is not SAMPLED), MAQ_ERROR_POOL_EMPTY, MAQ_ERROR_INFERENCE. Blocks while pixels are computed and networks
 * run. */
MAQ_API maq_status maq_predictor_acquire_sample(maq_predictor* predictor, uint32_t sample_index, uint32_t frame_index,
                                                maq_frame** frame);

/* Writes the entropy map of frame `frame_index` of sample `sample_index` (maq_predictor_acquire_sample). For each cell
 * it has the mean entropy of its codes in bits, given the sample's earlier frames; 0 while nothing moves. Writes
 * stats.cell_count floats, row by row from the top left. The cells divide a frame of any shape evenly. `capacity` is
 * the capacity of `bits`, in floats.
 * One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT (`capacity` is too small; a frame that was not sampled),
 * MAQ_ERROR_UNSUPPORTED (the method is not SAMPLED). Does not block. */
MAQ_API maq_status maq_predictor_copy_entropy_map(const maq_predictor* predictor, uint32_t sample_index,
                                                  uint32_t frame_index, float* bits, size_t capacity);

/* Forgets the frames so far, to begin another stream.
 * One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_predictor_reset(maq_predictor* predictor);

/* Returns times and counts. The caller sets stats->struct_size.
 * One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_predictor_get_stats(const maq_predictor* predictor, maq_predictor_stats* stats);

#ifdef __cplusplus
}
#endif

#endif /* MAQUETTE_PREDICTION_H_ */
