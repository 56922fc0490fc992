/* Pipeline: runs a source and a model on a thread of the library, for apps that must not block. The model is one of
 * densepose_model.h, edges_model.h or prediction_model.h. The newest frame is processed; frames that arrive while the
 * model is busy are dropped. Source, model and recording can be changed while the pipeline runs.
 *
 *   maq_densepose_model_create(context, NULL, &model);
 *   maq_pipeline_create(context, NULL, &pipeline);
 *   maq_pipeline_set_model(pipeline, model);
 *   maq_pipeline_set_source(pipeline, "camera:");
 *   while (maq_pipeline_acquire_result(pipeline, MAQ_WAIT_FOREVER, &result) == MAQ_OK) {
 *     const maq_frame* frame = maq_pipeline_result_get_frame(result);
 *     const maq_densepose_result* people = maq_pipeline_result_get_densepose(result);
 *     ... read them ...
 *     maq_pipeline_result_release(result);
 *   }
 */
#ifndef MAQUETTE_PIPELINE_H_
#define MAQUETTE_PIPELINE_H_

#include "maquette/source.h"

#ifdef __cplusplus
extern "C" {
#endif

/* A model that a pipeline runs. Each system creates its own: maq_densepose_model_create and others. */
typedef struct maq_model maq_model;
typedef struct maq_pipeline maq_pipeline;
typedef struct maq_pipeline_result maq_pipeline_result;

/* The state of a pipeline. Values never change meaning; new ones are added at the end. */
typedef enum maq_pipeline_state {
  MAQ_PIPELINE_STOPPED = 0,      /* no source: none was set yet, or maq_pipeline_stop was called */
  MAQ_PIPELINE_OPENING = 1,      /* the source is being opened */
  MAQ_PIPELINE_LOADING = 2,      /* the model is being loaded */
  MAQ_PIPELINE_RUNNING = 3,      /* results are delivered */
  MAQ_PIPELINE_PAUSED = 4,       /* by maq_pipeline_set_paused */
  MAQ_PIPELINE_STALLED = 5,      /* the camera sends no frames; it may recover by itself */
  MAQ_PIPELINE_RECONNECTING = 6, /* the camera was lost; the pipeline tries to reopen it for reconnect_ms */
  MAQ_PIPELINE_ENDED = 7,        /* the source has no more frames: the photo was processed, the clip ended */
  MAQ_PIPELINE_FAILED = 8        /* the source or the model cannot be used; maq_pipeline_get_info says why */
} maq_pipeline_state;

/* Receives each result on the pipeline's thread, which waits meanwhile: return promptly. The callee owns `result` and
 * releases it now or later. The callback may call any function of this header; it must not throw. */
typedef void (*maq_pipeline_result_callback)(void* user_data, maq_pipeline_result* result);

/* Receives each change of the state on the pipeline's thread, in order. `status` and `problem` are the values of
 * maq_pipeline_info at the time of the change. The text is valid during the call. The callback may call any function of
 * this header; it must not throw. */
typedef void (*maq_pipeline_state_callback)(void* user_data, maq_pipeline_state state, maq_status status,
                                            const char* problem);

/* Options. 0 and NULL are the default in every field. */
typedef struct maq_pipeline_config {
  uint32_t struct_size;
  uint32_t result_pool_size;       /* results that the app may hold at once, 1 to 64; 0 (default): 4 */
  const maq_source_config* source; /* for all sources. Copied. frame_pool_size is not used; state_callback must be
                                      NULL. */
  maq_pipeline_result_callback result_callback; /* NULL (default): take results by maq_pipeline_acquire_result */
  void* result_user_data;                       /* for result_callback */
  maq_pipeline_state_callback state_callback;   /* NULL (default): get the state by maq_pipeline_get_info */
  void* state_user_data;                        /* for state_callback */
  int32_t nice; /* added to the niceness of the threads of pipeline and model, 0 (default) to 19. Threads that draw have
                   priority then. Linux and Android; no effect elsewhere. */
} maq_pipeline_config;

typedef struct maq_pipeline_info {
  uint32_t struct_size;
  maq_pipeline_state state;
  maq_status status;      /* MAQ_OK, or why there are no results, or why the recording stopped */
  const char* problem;    /* the status in a sentence; "" with MAQ_OK */
  const char* source_uri; /* as it was set; "" when none was set */
} maq_pipeline_info;

/* Times of a result, in milliseconds. */
typedef struct maq_pipeline_result_stats {
  uint32_t struct_size;
  uint64_t number; /* counts the results of the pipeline, from 1; gaps are results that were dropped */
  double wait_ms;  /* the pipeline waited for the frame */
  double run_ms;   /* the model ran; 0 without a model */
  double age_ms;   /* from the capture of a camera's frame to the result; -1 if unknown */
} maq_pipeline_result_stats;

typedef struct maq_pipeline_stats {
  uint32_t struct_size;
  uint64_t result_count;          /* results so far */
  uint64_t dropped_result_count;  /* results that were replaced by a newer one before the app took them, or that came
                                     while the app held result_pool_size results */
  uint64_t dropped_frame_count;   /* frames of the current source that the camera lost, or that came while the model was
                                     busy */
  double results_per_second;      /* over the last second */
  double wait_ms, run_ms, age_ms; /* of the latest result (maq_pipeline_result_stats) */
} maq_pipeline_stats;

/* Frees the model (NULL is fine). A pipeline that runs the model keeps it until it gets another.
 * Once for each model, from any thread. May block briefly. */
MAQ_API void maq_model_destroy(maq_model* model);

/* Fills `config` with the defaults and sets struct_size. `struct_size` is sizeof(maq_pipeline_config) of the caller.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_pipeline_config_init(maq_pipeline_config* config, uint32_t struct_size);

/* Creates a pipeline without source and model. It is stopped until it gets a source. `config` may be NULL for the
 * defaults. Free `*pipeline` with maq_pipeline_destroy.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT, MAQ_ERROR_OUT_OF_MEMORY. Does not block. */
MAQ_API maq_status maq_pipeline_create(maq_context* context, const maq_pipeline_config* config,
                                       maq_pipeline** pipeline);

/* Stops the pipeline like maq_pipeline_stop and frees it (NULL is fine). Results that are still held stay valid until
 * they are released. Once for each pipeline, from any thread, also from its callbacks. Blocks until the current run or
 * loading of the model is done; does not wait for a device that hangs. */
MAQ_API void maq_pipeline_destroy(maq_pipeline* pipeline);

/* Opens a source by a URI (maq_source_create) and replaces the current one. The state becomes MAQ_PIPELINE_OPENING. No
 * result of the previous source can be acquired after the call; a callback with one may still run. After
 * MAQ_PIPELINE_FAILED, source and model are tried again. maq_pipeline_get_info reports errors of the opening.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_pipeline_set_source(maq_pipeline* pipeline, const char* uri);

/* Loads a model and replaces the current one. NULL: no model runs, and results have a frame only. The source stays
 * open; a photo is processed again. The app may destroy its handle after the call. After MAQ_PIPELINE_FAILED, source
 * and model are tried again. maq_pipeline_get_info reports errors of the loading.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT (another pipeline runs the model). Does not block. */
MAQ_API maq_status maq_pipeline_set_model(maq_pipeline* pipeline, maq_model* model);

/* Pauses with 1, resumes with 0. A paused pipeline finishes the current frame, then takes no more. The source stays
 * open.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_pipeline_set_paused(maq_pipeline* pipeline, int32_t is_paused);

/* Records the frames that are processed from now on to a file (recorder.h), which must not exist yet. NULL finishes the
 * recording; so does the end or a change of the source. If the recording fails, results continue, and
 * maq_pipeline_get_info reports the reason.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_pipeline_set_recording(maq_pipeline* pipeline, const char* path);

/* Closes the source. The model stays loaded; maq_pipeline_set_source starts again. After the call no callback runs or
 * begins, and waiting calls of maq_pipeline_acquire_result return MAQ_CANCELLED. If it is called from a callback, no
 * other callback begins.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Blocks only while a callback of the app runs; the pipeline's thread
 * finishes the current run of the model later. */
MAQ_API maq_status maq_pipeline_stop(maq_pipeline* pipeline);

/* Takes the newest result that was not taken yet. Otherwise waits for the next one, for at most `timeout_ns`
 * (MAQ_WAIT_FOREVER: without limit). Give `*result` back with maq_pipeline_result_release.
 * Any thread. Errors: MAQ_TIMEOUT, MAQ_END_OF_STREAM, MAQ_CANCELLED (the pipeline is stopped), MAQ_ERROR_POOL_EMPTY
 * (all results are held), MAQ_ERROR_UNSUPPORTED (it has a result_callback), MAQ_ERROR_INVALID_ARGUMENT. If the pipeline
 * failed: the status of maq_pipeline_info. Blocks until there is a result. */
MAQ_API maq_status maq_pipeline_acquire_result(maq_pipeline* pipeline, int64_t timeout_ns,
                                               maq_pipeline_result** result);

/* Gives the result back (NULL is fine), with its frame and the output of its model.
 * Once for each result, from any thread. Does not block. */
MAQ_API void maq_pipeline_result_release(maq_pipeline_result* result);

/* Returns the frame of a result, which belongs to the result; NULL for NULL. Each model's header has functions for its
 * output. Any thread. Does not fail or block. */
MAQ_API const maq_frame* maq_pipeline_result_get_frame(const maq_pipeline_result* result);

/* Gets number and times of a result. The caller sets stats->struct_size.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_pipeline_result_get_stats(const maq_pipeline_result* result, maq_pipeline_result_stats* stats);

/* Gets the state. The caller sets info->struct_size. The texts are valid until this thread calls this function again.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_pipeline_get_info(const maq_pipeline* pipeline, maq_pipeline_info* info);

/* Gets counts and times. The caller sets stats->struct_size.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_pipeline_get_stats(const maq_pipeline* pipeline, maq_pipeline_stats* stats);

#ifdef __cplusplus
}
#endif

#endif /* MAQUETTE_PIPELINE_H_ */
