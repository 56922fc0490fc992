/* Recordings: frames of any source in a file (.maqrec), which the source "rec:file.maqrec" plays. A recording keeps
 * timestamps, sequence numbers, depth and intrinsics, and has checksums. After a crash, all added frames are readable.
 * docs/reference/formats.md describes the file. */
#ifndef MAQUETTE_RECORDER_H_
#define MAQUETTE_RECORDER_H_

#include "maquette/source.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct maq_recorder maq_recorder;

typedef struct maq_recorder_config {
  uint32_t struct_size;
  uint32_t jpeg_quality;  /* 1 to 100: compress images as JPEG of this quality. 0 (default): no compression, 18 MB a
                             second at 640 x 480 YUYV and 30 frames a second. A camera's own JPEG images are never
                             changed. */
  int32_t keep_predicted; /* 1: record predicted frames, too, and mark them; 0 (default): refuse them */
} maq_recorder_config;

typedef struct maq_recorder_info {
  uint32_t struct_size;
  uint64_t frame_count;
  uint64_t size_bytes; /* size of the file */
} maq_recorder_info;

/* Fills `config` with the defaults and sets struct_size. `struct_size` is sizeof(maq_recorder_config) of the caller.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_recorder_config_init(maq_recorder_config* config, uint32_t struct_size);

/* Creates the file `path` (UTF-8), which must not exist yet. `source` (may be NULL) is the source of the frames. Its
 * rate and intrinsics are recorded; intrinsics of single frames are not. `config` may be NULL.
 * The caller owns `*recorder`: free it with maq_recorder_destroy.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT, MAQ_ERROR_UNWRITABLE. Blocks while the file is created. */
MAQ_API maq_status maq_recorder_create(maq_context* context, const char* path, const maq_source* source,
                                       const maq_recorder_config* config, maq_recorder** recorder);

/* Adds a frame. The file contains the whole frame when the call returns. Frames may differ in size and format.
 * One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT (not later than the previous frame). MAQ_ERROR_UNSUPPORTED (a
 * predicted frame, without keep_predicted). MAQ_ERROR_UNWRITABLE (the disk is full: earlier frames stay readable, and
 * adding works again once there is space). Blocks while it writes. */
MAQ_API maq_status maq_recorder_add_frame(maq_recorder* recorder, const maq_frame* frame);

/* Writes the index and closes the file. Without the index, a player has to search for the frames.
 * One at a time. Errors: MAQ_ERROR_UNWRITABLE. Blocks until the file is on the disk. */
MAQ_API maq_status maq_recorder_finish(maq_recorder* recorder);

/* Gets the number of frames and bytes written so far. The caller sets info->struct_size.
 * One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_recorder_get_info(const maq_recorder* recorder, maq_recorder_info* info);

/* Closes the file (NULL is fine). Without maq_recorder_finish the index is missing. A file without a frame is removed.
 * Once for each recorder, from any thread. Does not block. */
MAQ_API void maq_recorder_destroy(maq_recorder* recorder);

#ifdef __cplusplus
}
#endif

#endif /* MAQUETTE_RECORDER_H_ */
