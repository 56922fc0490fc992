/* Clips: pictures as a video file that any player shows. To keep what a camera saw, exactly and with its times, use a
 * recorder (recorder.h). */
#ifndef MAQUETTE_CLIP_H_
#define MAQUETTE_CLIP_H_

#include "maquette/frame.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct maq_clip maq_clip;

/* Begins a video file: MPEG-4 in .mp4 or Motion JPEG in .avi, by the path's ending. It appears at `path`, in place of a file
 * that is there, when maq_clip_finish is called. `fps`: above 0, to 1000. `*clip` is the caller's, to be given to
 * maq_clip_destroy.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT (another ending), MAQ_ERROR_UNWRITABLE, MAQ_ERROR_RUNTIME_LIBRARY
 * (libmaquette_files.so is missing). May block while libraries are opened. */
MAQ_API maq_status maq_clip_create(maq_context* context, const char* path, double fps, maq_clip** clip);

/* Adds a picture. All have the size of the first; of an odd width or height the last column or row is left out.
 * One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT (another size), MAQ_ERROR_UNSUPPORTED (a depth image; with the first
 * picture also: this build cannot write that kind of file, the other may do), MAQ_ERROR_UNWRITABLE. Blocks while it is
 * encoded. */
MAQ_API maq_status maq_clip_add(maq_clip* clip, const maq_frame* frame);

/* Completes the file. After it nothing can be added.
 * One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT (nothing was added), MAQ_ERROR_UNWRITABLE. Blocks until it is
 * written. */
MAQ_API maq_status maq_clip_finish(maq_clip* clip);

/* Frees the clip (NULL is fine); what was not finished is removed.
 * Once for each clip, from any thread. May block shortly. */
MAQ_API void maq_clip_destroy(maq_clip* clip);

#ifdef __cplusplus
}
#endif

#endif /* MAQUETTE_CLIP_H_ */
