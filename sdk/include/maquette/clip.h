/* Clips: pictures as a video file that any player shows. To keep what a camera saw, exactly and with its times, use a
 * recorder (recorder.h). */
#ifndef MAQUETTE_CLIP_H_
#define MAQUETTE_CLIP_H_

#include "maquette/frame.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct maq_clip maq_clip;

/* Begins a video file: MPEG-4 in .mp4 or Motion JPEG in .avi, by the path's ending. It is written beside its place, in a
 * folder that is there, and appears at `path`, in place of a file that is there, when maq_clip_finish is called.
 * `fps`: pictures a second, 0.01 to 1000, rounded to three decimals, above 65.5 to four digits. `*clip` is the caller's,
 * to be given to maq_clip_destroy.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT (another ending), MAQ_ERROR_UNWRITABLE, MAQ_ERROR_RUNTIME_LIBRARY
 * (libmaquette_files.so is missing). May block while libraries are opened. */
MAQ_API maq_status maq_clip_create(maq_context* context, const char* path, double fps, maq_clip** clip);

/* Adds a picture, which is not kept. All have the size of the first, 2 x 2 at least; of an odd width or height the last
 * column or row is left out. They are shown `1 / fps` seconds each: their timestamps are not asked.
 * One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT (another size, or the clip is finished), MAQ_ERROR_IMAGE_SIZE (too
 * small), MAQ_ERROR_UNSUPPORTED (a depth image; with the first picture also: this build cannot write that kind of file, or
 * not of that size; the other kind may do), MAQ_ERROR_UNWRITABLE (the disk is full already). Blocks while it is encoded. */
MAQ_API maq_status maq_clip_add_frame(maq_clip* clip, const maq_frame* frame);

/* Completes the file. After it nothing can be added. Only here is it known whether the disk took all of it.
 * One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT (nothing was added), MAQ_ERROR_UNWRITABLE (the disk is full; a file that
 * was there stays). Blocks until it is on the disk. */
MAQ_API maq_status maq_clip_finish(maq_clip* clip);

/* Frees the clip (NULL is fine); what was not finished is removed.
 * Once for each clip, from any thread. May block shortly. */
MAQ_API void maq_clip_destroy(maq_clip* clip);

#ifdef __cplusplus
}
#endif

#endif /* MAQUETTE_CLIP_H_ */
