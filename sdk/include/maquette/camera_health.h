/* Camera health: is the camera of a stream all right? */
#ifndef MAQUETTE_CAMERA_HEALTH_H_
#define MAQUETTE_CAMERA_HEALTH_H_

#include "maquette/frame.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Takes the frames of a stream and reports what happens to its camera: it freezes, turns black, is covered or knocked.
 * Needs no networks: each frame is compared with the frame before along its motion, at some 80 pixels a side.
 *
 *   maq_camera_health_create(context, &health);
 *   result.struct_size = sizeof result;
 *   maq_camera_health_push(health, frame, &result);   // each frame of the stream
 *   if (result.event != MAQ_CAMERA_OK) { ... } */
typedef struct maq_camera_health maq_camera_health;

/* Events of a camera. Values never change meaning; new ones are added at the end. */
typedef enum maq_camera_event {
  MAQ_CAMERA_OK = 0,      /* nothing */
  MAQ_CAMERA_CUT = 1,     /* another scene: the frames after it are not like those before */
  MAQ_CAMERA_FREEZE = 2,  /* frames are equal, byte for byte, for 0.3 s (three of them or more) */
  MAQ_CAMERA_BLACK = 3,   /* the whole picture is black */
  MAQ_CAMERA_COVERED = 4, /* a large part of the picture lost its detail at once, as by a hand, cloth or spray */
  MAQ_CAMERA_MOVED = 5,   /* the camera was knocked or turned: the picture jumped and then rests */
  MAQ_CAMERA_OBJECT = 6   /* something is there at once that did not move into the picture */
} maq_camera_event;

/* Returns the event in one word: "ok", "cut", "freeze", "black", "covered", "moved" or "object"; "unknown" for another
 * value. Any thread. Does not fail or block. */
MAQ_API const char* maq_camera_event_get_name(maq_camera_event event);

/* The result for one frame. */
typedef struct maq_camera_health_result {
  uint32_t struct_size;
  maq_camera_event event;  /* found with this frame, mostly MAQ_CAMERA_OK. CUT, COVERED, MOVED and OBJECT are found when
                              the picture rests again: CUT mostly one frame after it began, the others five, at most
                              31. */
  maq_camera_event state;  /* what lasts: FREEZE, BLACK or COVERED, or MAQ_CAMERA_OK */
  int64_t began_ns;        /* of an event: the timestamp of its first frame */
  float x_px;              /* OBJECT: its middle. MOVED: how far the picture moved to the right. Otherwise 0 */
  float y_px;              /* the same, from the top, and downward */
  float unexplained;       /* fraction of the frame that no motion from the frame before explains: 0 to 1 */
  int32_t columns;         /* of the map */
  int32_t rows;            /* of the map; 0 for frames below some 32 pixels, of which only FREEZE and BLACK are found */
  int32_t is_stream_start; /* 1: the frame continues no stream: the first one, another size, format or clock, an
                              earlier time, or more than a second later */
} maq_camera_health_result;

/* Wall-clock milliseconds of the latest frame, and counts since creation. */
typedef struct maq_camera_health_stats {
  uint32_t struct_size;
  float push_ms;
  uint64_t pushed_count;       /* frames */
  uint64_t event_count;        /* frames with an event */
  uint64_t stream_start_count; /* frames with is_stream_start */
} maq_camera_health_stats;

/* Creates the check of one stream's camera. Free `*health` with maq_camera_health_destroy.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_camera_health_create(maq_context* context, maq_camera_health** health);

/* Frees it (NULL is fine).
 * Once for each handle, from any thread. May block briefly. */
MAQ_API void maq_camera_health_destroy(maq_camera_health* health);

/* Checks the stream's next frame, of any size and format except depth. The frame is not kept. The caller sets
 * result->struct_size. An error leaves the stream as it was before the frame.
 * One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT, MAQ_ERROR_UNSUPPORTED (a depth image). Blocks for about a
 * millisecond. */
MAQ_API maq_status maq_camera_health_push(maq_camera_health* health, const maq_frame* frame,
                                          maq_camera_health_result* result);

/* Writes the map of the latest frame: how far motion leaves each cell unexplained, 0 to 1; from 0.5 on a cell counts in
 * `unexplained`. Writes columns * rows floats, row by row from the top left. `capacity` is the capacity of `values`, in
 * floats.
 * One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT (`capacity` is too small; before the first frame). Does not
 * block. */
MAQ_API maq_status maq_camera_health_copy_map(const maq_camera_health* health, float* values, size_t capacity);

/* Forgets the frames so far, to begin another stream.
 * One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_camera_health_reset(maq_camera_health* health);

/* Returns times and counts. The caller sets stats->struct_size.
 * One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_camera_health_get_stats(const maq_camera_health* health, maq_camera_health_stats* stats);

#ifdef __cplusplus
}
#endif

#endif /* MAQUETTE_CAMERA_HEALTH_H_ */
