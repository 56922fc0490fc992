/* Error concealment: fills short gaps of a live source with predicted frames. */
#ifndef MAQUETTE_CONCEALER_H_
#define MAQUETTE_CONCEALER_H_

#include "maquette/prediction.h"
#include "maquette/source.h"

#ifdef __cplusplus
extern "C" {
#endif

/* A concealer delivers the frames of a live source at its rate. A frame that does not come in time is replaced by a
 * predicted one; maq_frame_get_origin tells them apart. After max_gap_ms without a captured frame no more are
 * predicted, and calls return the source's own status. An app that acts on its frames, such as a robot's, must check
 * the origin of every frame, or not use a concealer.
 *
 *   maq_source_create(context, "camera:", NULL, &source);
 *   maq_concealer_create(context, source, NULL, &concealer);
 *   while (maq_concealer_acquire_frame(concealer, MAQ_WAIT_FOREVER, &frame) == MAQ_OK) {
 *     ... read the frame ...
 *     maq_frame_release(frame);
 *   }
 */
typedef struct maq_concealer maq_concealer;

/* Options. 0 is the default in every field. */
typedef struct maq_concealer_config {
  uint32_t struct_size;
  int32_t max_gap_ms;          /* the longest gap that is filled, 1 to 10000; 0 (default): 300 */
  int32_t threads;             /* 1 to 64; 0 (default): the machine's large cores, at most 4 */
  maq_predictor_method method; /* AUTO (default), LAST or MOTION */
  uint32_t frame_pool_size;    /* frames the app may hold at once, 1 to 64; 0 (default): 3. The concealer itself holds
                                  one frame of the source's pool. */
} maq_concealer_config;

/* Counts, and wall-clock milliseconds. */
typedef struct maq_concealer_stats {
  uint32_t struct_size;
  uint64_t captured_count;  /* captured frames that came in time */
  uint64_t predicted_count; /* predicted frames */
  uint64_t late_count;      /* captured frames that came after their predicted replacement: not delivered */
  uint64_t dropped_count;   /* frames that the app did not acquire in time */
  float latest_gap_ms;      /* length of the latest gap, up to max_gap_ms */
  float latest_wait_ms;     /* latest predicted frame: time from when it was due until it was ready */
  float max_wait_ms;        /* the longest such time */
} maq_concealer_stats;

/* Fills `config` with the defaults and sets struct_size. `struct_size` is sizeof(maq_concealer_config) of the caller.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_concealer_config_init(maq_concealer_config* config, uint32_t struct_size);

/* Creates a concealer of a live source. Free `*concealer` with maq_concealer_destroy. The source stays the app's; both
 * may be destroyed in any order. While the concealer exists it takes the source's frames, and maq_source_acquire_frame
 * returns MAQ_ERROR_BUSY. Controls, states and maq_source_stop work as before. The frame interval is known from the
 * sixth frame on; gaps are filled from then. A frame is due one and an eighth interval after the frame before. `config`
 * may be NULL for the defaults.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT, MAQ_ERROR_UNSUPPORTED (the source is not live), MAQ_ERROR_BUSY (it
 * has a concealer already), MAQ_ERROR_OUT_OF_MEMORY (no more threads). Does not block. */
MAQ_API maq_status maq_concealer_create(maq_context* context, maq_source* source, const maq_concealer_config* config,
                                        maq_concealer** concealer);

/* Frees the concealer (NULL is fine) within 50 ms. Its frames stay valid until they are released.
 * Once for each concealer, from any thread, while no call on it runs: maq_source_stop ends such calls. */
MAQ_API void maq_concealer_destroy(maq_concealer* concealer);

/* Returns the next frame, captured or predicted. Returns the newest one when several came since the latest call. The
 * timestamp of a predicted frame is the time that it shows; its sequence is the newest captured frame's. Timestamps
 * always increase. `*frame` comes from a pool of frame_pool_size: give it back with maq_frame_release.
 * One at a time. Errors: the errors of maq_source_acquire_frame. Blocks until a frame comes or is due, for at most
 * timeout_ns. */
MAQ_API maq_status maq_concealer_acquire_frame(maq_concealer* concealer, int64_t timeout_ns, maq_frame** frame);

/* Returns counts and times. The caller sets stats->struct_size.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_concealer_get_stats(const maq_concealer* concealer, maq_concealer_stats* stats);

#ifdef __cplusplus
}
#endif

#endif /* MAQUETTE_CONCEALER_H_ */
