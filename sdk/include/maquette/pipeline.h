/* Pipeline: runs a source and a model on a thread of the library, for apps that must not block: dense pose, edges of a
 * depth camera with their curves, or what comes next and surprise. The newest frame is processed; frames that come
 * while the model is busy are dropped. Source, model and recording can be changed while it runs.
 *
 *   maq_pipeline_create(context, &config, &pipeline);
 *   maq_pipeline_set_source(pipeline, "camera:");
 *   maq_pipeline_result result = {.struct_size = sizeof result};
 *   while (maq_pipeline_acquire_result(pipeline, MAQ_WAIT_FOREVER, &result) == MAQ_OK) {
 *     ... read result.frame and result.densepose ...
 *     maq_pipeline_release_result(&result);
 *   }
 */
#ifndef MAQUETTE_PIPELINE_H_
#define MAQUETTE_PIPELINE_H_

#include "maquette/densepose.h"
#include "maquette/edge_curves.h"
#include "maquette/prediction.h"
#include "maquette/source.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct maq_pipeline maq_pipeline;

/* What a pipeline does. Values never change meaning; new ones are added at the end. */
typedef enum maq_pipeline_state {
  MAQ_PIPELINE_STOPPED = 0,      /* no source: none was set yet, or maq_pipeline_stop was called */
  MAQ_PIPELINE_OPENING = 1,      /* the source is being opened */
  MAQ_PIPELINE_LOADING = 2,      /* the model is being loaded */
  MAQ_PIPELINE_RUNNING = 3,      /* results are delivered */
  MAQ_PIPELINE_PAUSED = 4,       /* by maq_pipeline_set_paused */
  MAQ_PIPELINE_STALLED = 5,      /* the camera sends no frames; it may recover by itself */
  MAQ_PIPELINE_RECONNECTING = 6, /* the camera was lost; the pipeline tries to reopen it for reconnect_ms */
  MAQ_PIPELINE_ENDED = 7,        /* the source has no more frames: the photo was processed, the clip ended */
  MAQ_PIPELINE_FAILED = 8        /* the source or the model cannot be used; maq_pipeline_info says why */
} maq_pipeline_state;

/* A result with its frame. New fields are added at the end. */
typedef struct maq_pipeline_result {
  uint32_t struct_size;
  maq_frame* frame;                /* the caller's: for maq_frame_release or maq_pipeline_release_result */
  maq_densepose_result* densepose; /* the caller's: for maq_densepose_result_release or maq_pipeline_release_result;
                                      NULL where another model runs */
  uint64_t number;                 /* counts the results of the pipeline, from 1; gaps are results that were dropped */
  double wait_ms;                  /* time that the pipeline waited for the frame */
  double run_ms;                   /* time that the model took; see maq_densepose_result_get_stats for its stages */
  double age_ms;                   /* from the capture of a camera's frame to the result; -1 if unknown */
  maq_edges_result* edges;         /* the caller's, as densepose; NULL where another model runs */
  maq_edges_curves* curves;        /* the caller's; NULL where they were not asked for */
  /* By maq_pipeline_set_prediction: */
  maq_frame* predicted; /* the caller's, as frame: what the source will show after it, marked (maq_frame_get_origin);
                           NULL where another model runs */
  float surprise_bits;  /* of frame, as in maq_surprise_score; so are the next four. -1 where it was not asked for */
  float surprise_ratio;
  int32_t is_event;
  int32_t is_cut;
  int32_t is_start;
} maq_pipeline_result;

/* Receives each result on the pipeline's thread, which waits meanwhile: return promptly. `result` is valid during the
 * call; the objects in it are the callee's from then on, to be released now or later. The
 * callback may call any function of this header; it must not throw. */
typedef void (*maq_pipeline_result_callback)(void* user_data, const maq_pipeline_result* result);

/* Receives each change of the state on the pipeline's thread, in order. `status` and `problem` are as in
 * maq_pipeline_info at the time of the change; the text is valid during the call. The callback may call any function of
 * this header; it must not throw. */
typedef void (*maq_pipeline_state_callback)(void* user_data, maq_pipeline_state state, maq_status status,
                                            const char* problem);

typedef struct maq_pipeline_config {
  uint32_t struct_size;
  uint32_t result_pool_size;             /* results, and frames, that the app may hold at once, 1 to 64;
                                                   default 4 */
  const maq_densepose_config* densepose; /* the model; NULL (default): the defaults. Copied, result_pool_size unused. */
  const maq_source_config* source;       /* of all sources; NULL (default): the defaults. Copied, frame_pool_size is not
                                                   used and state_callback must be NULL. */
  maq_pipeline_result_callback result_callback; /* NULL (default): results are taken by maq_pipeline_acquire_result */
  void* result_user_data;                       /* of result_callback */
  maq_pipeline_state_callback state_callback;   /* NULL (default): get the state with maq_pipeline_get_info */
  void* state_user_data;                        /* of state_callback */
  int32_t nice;                                 /* added to the niceness of the pipeline's and the model's threads,
                                                   0 (default) to 19, so that drawing threads have priority. Linux and
                                                   Android; no effect elsewhere. */
  /* What the model may take for a frame of a stream, in the mean, as on a device that throttles: 0 (default): any time;
   * else up to 60000. When it takes longer, people are detected in every 2nd and then every 4th frame
   * (key_frame_interval), then long_side_px is lowered, in steps of 32 pixels, to no less than half. Both come back,
   * step by step, when there has been time for some seconds. */
  double frame_budget_ms;
  /* NULL (default): dense pose runs. Otherwise edges are found instead, in frames with depth of a source that gives its
   * intrinsics (source.h), with these options; densepose must be NULL then, and frame_budget_ms has no effect. Copied,
   * result_pool_size unused. */
  const maq_edges_config* edges;
  const maq_edges_curves_config* curves; /* with edges: curves are found too, with these options; NULL (default): not.
                                            Copied. */
} maq_pipeline_config;

typedef struct maq_pipeline_info {
  uint32_t struct_size;
  maq_pipeline_state state;
  maq_status status;      /* MAQ_OK, or why there are no results, or why the recording stopped */
  const char* problem;    /* the status in a sentence; "" with MAQ_OK */
  const char* source_uri; /* as it was set; "" when none was set */
} maq_pipeline_info;

typedef struct maq_pipeline_stats {
  uint32_t struct_size;
  uint64_t result_count;         /* made so far */
  uint64_t dropped_result_count; /* of these: replaced by a newer one before they were taken, or made while the app held
                                    as many as it may */
  uint64_t dropped_frame_count;  /* of the current source: lost by the camera, or while the model was busy */
  double results_per_second;     /* over the last second */
  double wait_ms, run_ms, age_ms; /* of the latest result, as in maq_pipeline_result */
  int32_t key_frame_interval;     /* of the model's config, or what frame_budget_ms makes of it; 0 before a result, and
                                     with edges */
  int32_t long_side_px;           /* the same */
} maq_pipeline_stats;

/* Fills `config` with the defaults and sets struct_size. `struct_size` is sizeof(maq_pipeline_config) of the caller.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_pipeline_config_init(maq_pipeline_config* config, uint32_t struct_size);

/* Creates a pipeline, which is stopped until it is given a source; the model is loaded when the first source is open.
 * `*pipeline` is the caller's, to be given to maq_pipeline_destroy.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_pipeline_create(maq_context* context, const maq_pipeline_config* config,
                                       maq_pipeline** pipeline);

/* Stops the pipeline as maq_pipeline_stop does and frees it (NULL is fine). Results still held stay valid until they
 * are released. Once for each pipeline, from any thread, also from its callbacks. Blocks until the current run or
 * loading of the model is done; does not wait for a device that hangs. */
MAQ_API void maq_pipeline_destroy(maq_pipeline* pipeline);

/* Opens a source, by a URI as for maq_source_create, in place of the current one; the state becomes
 * MAQ_PIPELINE_OPENING. No result of the previous source can be acquired after the call; a callback with one may still
 * be running. After MAQ_PIPELINE_FAILED everything is tried again. maq_pipeline_info has errors of the opening.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_pipeline_set_source(maq_pipeline* pipeline, const char* uri);

/* Loads the model with other options, or another model, in place of the current one. `config` NULL: the defaults. It is
 * copied; result_pool_size is not used. The source stays open; a photo is processed again. After MAQ_PIPELINE_FAILED
 * everything is tried again.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT; maq_pipeline_info has errors of the loading. Does not
 * block. */
MAQ_API maq_status maq_pipeline_set_densepose(maq_pipeline* pipeline, const maq_densepose_config* config);

/* The same with edges of depth frames in place of the current model. `config` NULL: the defaults. `curves` NULL: none
 * are found; otherwise with these options. Both are copied. Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT;
 * maq_pipeline_info has errors of the loading. Does not block. */
MAQ_API maq_status maq_pipeline_set_edges(maq_pipeline* pipeline, const maq_edges_config* config,
                                          const maq_edges_curves_config* curves);

/* maq_densepose_set_roll for the next frames of dense pose, whatever the source and the model; edges don't need it.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_pipeline_set_roll(maq_pipeline* pipeline, float roll_rad);

/* The same with the picture that comes `ahead_s` seconds after each frame, 0 to 10, and with how surprising the frame
 * is, unless `surprise` is NULL. The pipeline makes streams of its own with the settings and the networks of
 * `predictor` and `surprise`, which stay the caller's, see none of its frames and may be destroyed at once. Frames are
 * dropped while it runs: networks that take long, as those that draw, give few results a second. Gaps are not bridged
 * (concealer.h). Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT; maq_pipeline_info has those of frames, as of a depth
 * image. Does not block. */
MAQ_API maq_status maq_pipeline_set_prediction(maq_pipeline* pipeline, const maq_predictor* predictor, double ahead_s,
                                               const maq_surprise* surprise);

/* Pauses with 1, resumes with 0. A paused pipeline finishes the current frame, then takes no more. The source stays
 * open.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_pipeline_set_paused(maq_pipeline* pipeline, int32_t is_paused);

/* Records the frames that are processed from now on to a file (recorder.h), which must not exist yet. NULL, or the end
 * or a change of the source, finishes the recording. If the recording fails, results continue, and maq_pipeline_info
 * has the reason.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_pipeline_set_recording(maq_pipeline* pipeline, const char* path);

/* Closes the source; the model stays loaded, and maq_pipeline_set_source starts again. After the call no callback runs
 * or begins, and waiting calls of maq_pipeline_acquire_result return MAQ_CANCELLED. Called from a callback: no other
 * callback begins.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Blocks only while a callback of the app runs; the pipeline's thread
 * finishes the current run of the model later. */
MAQ_API maq_status maq_pipeline_stop(maq_pipeline* pipeline);

/* Takes the newest result that was not taken yet, or waits for the next one for at most `timeout_ns` (MAQ_WAIT_FOREVER:
 * without limit). The caller sets result->struct_size; the objects in it are the caller's afterwards.
 * Any thread. Errors: MAQ_TIMEOUT, MAQ_END_OF_STREAM, MAQ_CANCELLED (the pipeline is stopped), MAQ_ERROR_POOL_EMPTY
 * (all results are held), MAQ_ERROR_UNSUPPORTED (it has a result_callback), MAQ_ERROR_INVALID_ARGUMENT; when the
 * pipeline failed, the status of maq_pipeline_info. Blocks until there is a result. */
MAQ_API maq_status maq_pipeline_acquire_result(maq_pipeline* pipeline, int64_t timeout_ns, maq_pipeline_result* result);

/* Releases the objects of the result, unless NULL, and sets them to NULL (a NULL `result` is fine).
 * Once for each result, from any thread. Does not block. */
MAQ_API void maq_pipeline_release_result(maq_pipeline_result* result);

/* Gets the state. The caller sets info->struct_size; the texts are valid until this thread calls this function again.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_pipeline_get_info(const maq_pipeline* pipeline, maq_pipeline_info* info);

/* Gets counts and times. The caller sets stats->struct_size.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_pipeline_get_stats(const maq_pipeline* pipeline, maq_pipeline_stats* stats);

/* Gets the surface that the model's labels refer to, once a model is loaded; like maq_densepose_get_surface. The points
 * live as long as the pipeline, also when the model is replaced.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT, MAQ_ERROR_UNSUPPORTED (no model is loaded, or it has none: only dense
 * pose does), MAQ_ERROR_BAD_BUNDLE (it is damaged). Blocks briefly the first time, while it is decoded. */
MAQ_API maq_status maq_pipeline_get_surface(maq_pipeline* pipeline, maq_densepose_surface* surface);

#ifdef __cplusplus
}
#endif

#endif /* MAQUETTE_PIPELINE_H_ */
