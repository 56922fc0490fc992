/* Concealers: live sources whose short gaps are bridged by predicted frames. */
#ifndef MAQUETTE_CONCEALER_H_
#define MAQUETTE_CONCEALER_H_

#include "maquette/prediction.h"
#include "maquette/source.h"

#ifdef __cplusplus
extern "C" {
#endif

/* A concealer gives the frames of a live source at its rate. One that is not there when it is due is replaced by one
 * that was predicted before; maq_frame_get_origin says so of each. When the camera has sent nothing for max_gap_ms,
 * there are no more predicted frames, and calls return what the source's own would. An app that acts on what it sees,
 * such as a robot's, must look at the origin of every frame, or not use a concealer.
 *
 *   maq_source_create(context, "camera:", NULL, &source);
 *   maq_concealer_create(context, source, NULL, &concealer);
 *   while (maq_concealer_acquire_frame(concealer, MAQ_WAIT_FOREVER, &frame) == MAQ_OK) { … maq_frame_release(frame); }
 */
typedef struct maq_concealer maq_concealer;

typedef struct maq_concealer_config {
  uint32_t struct_size;
  int32_t max_gap_ms;           /* how far ahead frames are predicted, 1 to 10000; default 300 */
  int32_t threads;              /* as of maq_predictor_config */
  maq_prediction_method method; /* as of maq_predictor_config */
  uint32_t frame_pool_size;     /* frames the app may hold at once, 1 to 64; default 3. One more of the source's
                                   frame_pool_size is held by the concealer. */
} maq_concealer_config;

typedef struct maq_concealer_stats {
  uint32_t struct_size;
  uint64_t captured_count;  /* frames of the source that were there in time */
  uint64_t predicted_count; /* frames made up in place of others */
  uint64_t late_count;      /* frames of the source that came after a predicted one had stood for them: not delivered */
  uint64_t dropped_count;   /* frames that the app did not acquire in time */
  float latest_gap_ms;      /* the latest gap, as far as it was bridged */
  float latest_wait_ms;     /* the latest predicted frame: from when it was due until it was there */
  float max_wait_ms;        /* the longest of these */
} maq_concealer_stats;

/* Fills `config` with the defaults and sets struct_size. `struct_size` is sizeof(maq_concealer_config) of the caller.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_concealer_config_init(maq_concealer_config* config, uint32_t struct_size);

/* Makes a concealer of a live source, which stays the app's: they may be destroyed in any order. Until the concealer is
 * destroyed it takes the source's frames, and maq_source_acquire_frame returns MAQ_ERROR_BUSY; controls, states and
 * maq_source_stop work as before. A frame is due an eighth of the time between frames after it was expected; that time
 * is known, and gaps are bridged, from the sixth frame on. `config` may be NULL for the defaults. `*concealer` is the
 * caller's, to be given to maq_concealer_destroy.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT, MAQ_ERROR_UNSUPPORTED (the source is not live), MAQ_ERROR_BUSY (it
 * has a concealer already), MAQ_ERROR_OUT_OF_MEMORY (no more threads). Does not block. */
MAQ_API maq_status maq_concealer_create(maq_context* context, maq_source* source, const maq_concealer_config* config,
                                        maq_concealer** concealer);

/* Frees the concealer (NULL is fine) within 50 ms. Frames that it gave stay valid until they are released.
 * Once for each concealer, from any thread, when no call on it runs: maq_source_stop ends those. */
MAQ_API void maq_concealer_destroy(maq_concealer* concealer);

/* Gets the next frame, captured or predicted; the newest, where several have come since the last call. A predicted
 * frame has the time that it stands for as its timestamp and the sequence of the captured frame that it was made from.
 * Timestamps grow from frame to frame. `*frame` comes from a pool of frame_pool_size: give it back with
 * maq_frame_release.
 * One at a time. Errors: those of maq_source_acquire_frame. Blocks until a frame has come or is due, for at most
 * timeout_ns. */
MAQ_API maq_status maq_concealer_acquire_frame(maq_concealer* concealer, int64_t timeout_ns, maq_frame** frame);

/* Gets counts and times. The caller sets stats->struct_size.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_concealer_get_stats(const maq_concealer* concealer, maq_concealer_stats* stats);

#ifdef __cplusplus
}
#endif

#endif /* MAQUETTE_CONCEALER_H_ */
