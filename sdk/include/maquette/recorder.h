/* Recordings: frames of any source in a file (.maqrec), to be played by the source "rec:file.maqrec". They keep the times,
 * numbers, depth and calibration of the frames, carry checksums, and survive a crash: every frame that was added can be
 * read. docs/formats.md has the layout. */
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
} maq_recorder_config;

typedef struct maq_recorder_info {
  uint32_t struct_size;
  uint64_t frame_count;
  uint64_t size_bytes; /* of the file */
} maq_recorder_info;

/* Fills `config` with the defaults and sets struct_size. `struct_size` is sizeof(maq_recorder_config) of the caller.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_recorder_config_init(maq_recorder_config* config, uint32_t struct_size);

/* Makes the file at `path` (UTF-8), which must not be there yet. `source`, which may be NULL, is where the frames will
 * come from: its rate and calibration are noted down. `config` may be NULL.
 * `*recorder` is the caller's, to be given to maq_recorder_destroy.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT, MAQ_ERROR_UNWRITABLE. Blocks while the file is made. */
MAQ_API maq_status maq_recorder_create(maq_context* context, const char* path, const maq_source* source,
                                       const maq_recorder_config* config, maq_recorder** recorder);

/* Writes a frame: it is in the file, whole, when the call returns. Frames may have different sizes and formats.
 * One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT (not later than the frame before), MAQ_ERROR_UNWRITABLE (the disk is
 * full: the frames before are whole, and one can be added again when there is room). Blocks while it is written. */
MAQ_API maq_status maq_recorder_add_frame(maq_recorder* recorder, const maq_frame* frame);

/* Writes the index, which saves a player from looking for the frames, and closes the file.
 * One at a time. Errors: MAQ_ERROR_UNWRITABLE. Blocks until the disk has all. */
MAQ_API maq_status maq_recorder_finish(maq_recorder* recorder);

/* What was written so far. The caller sets info->struct_size.
 * Not while a frame is added. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_recorder_get_info(const maq_recorder* recorder, maq_recorder_info* info);

/* Closes the file (NULL is fine); the index is missing unless maq_recorder_finish was called.
 * Once for each recorder, from any thread. Does not block. */
MAQ_API void maq_recorder_destroy(maq_recorder* recorder);

#ifdef __cplusplus
}
#endif

#endif /* MAQUETTE_RECORDER_H_ */
