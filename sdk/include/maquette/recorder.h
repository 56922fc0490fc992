/* Recordings: frames of any source in a file (.maqrec), which the source "rec:file.maqrec" plays. They keep timestamps,
 * sequence numbers, depth and intrinsics, and have checksums. After a crash, every frame that was added can be read.
 * docs/formats.md describes the file. */
#ifndef MAQUETTE_RECORDER_H_
#define MAQUETTE_RECORDER_H_

#include "maquette/source.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct maq_recorder maq_recorder;

typedef struct maq_recorder_config {
  uint32_t struct_size;
  /* 0 (default): pixels stay as they are, 18 MB a second at 640 x 480 YUYV and 30 frames a second. 1 to 100: they are
   * compressed as JPEG of that quality. What a camera sends as JPEG is kept as it came in both cases. */
  uint32_t jpeg_quality;
  int32_t keep_predicted; /* 1: frames that a predictor made up are recorded too, marked as such; 0 (default): they are
                             refused */
} maq_recorder_config;

typedef struct maq_recorder_info {
  uint32_t struct_size;
  uint64_t frame_count;
  uint64_t size_bytes; /* of the file */
} maq_recorder_info;

/* Fills `config` with the defaults and sets struct_size. `struct_size` is sizeof(maq_recorder_config) of the caller.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_recorder_config_init(maq_recorder_config* config, uint32_t struct_size);

/* Creates the file `path` (UTF-8), which must not exist yet. `source`, which may be NULL, is where the frames will come
 * from: its rate and intrinsics are recorded too. `config` may be NULL.
 * `*recorder` is the caller's, to be given to maq_recorder_destroy.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT, MAQ_ERROR_UNWRITABLE. Blocks while the file is created. */
MAQ_API maq_status maq_recorder_create(maq_context* context, const char* path, const maq_source* source,
                                       const maq_recorder_config* config, maq_recorder** recorder);

/* Adds a frame, which is complete in the file when the call returns. Frames may have different sizes and formats.
 * One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT (not later than the frame before), MAQ_ERROR_UNSUPPORTED (a
 * predicted frame, without keep_predicted), MAQ_ERROR_UNWRITABLE (the disk is full: earlier frames stay readable, and
 * frames can be added again once there is space). Blocks while it is written. */
MAQ_API maq_status maq_recorder_add_frame(maq_recorder* recorder, const maq_frame* frame);

/* Writes the index, without which a player has to search for the frames, and closes the file.
 * One at a time. Errors: MAQ_ERROR_UNWRITABLE. Blocks until the file is on the disk. */
MAQ_API maq_status maq_recorder_finish(maq_recorder* recorder);

/* Gets how much has been written so far. The caller sets info->struct_size.
 * Not while a frame is added. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_recorder_get_info(const maq_recorder* recorder, maq_recorder_info* info);

/* Closes the file (NULL is fine); unless maq_recorder_finish was called, the index is missing, and a file without a
 * frame is removed.
 * Once for each recorder, from any thread. Does not block. */
MAQ_API void maq_recorder_destroy(maq_recorder* recorder);

#ifdef __cplusplus
}
#endif

#endif /* MAQUETTE_RECORDER_H_ */
