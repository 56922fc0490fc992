/* Clips: images in a video file. They play in Chrome, Edge, Firefox, VLC, mpv and all players that use FFmpeg;
 * QuickTime and other players without VP9 refuse them. To keep frames exactly, with their times, use a recorder
 * (recorder.h). */
#ifndef MAQUETTE_CLIP_H_
#define MAQUETTE_CLIP_H_

#include "maquette/frame.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct maq_clip maq_clip;

/* Begins a video file: VP9 in MP4, named .mp4. It is written under another name in the same folder, which must exist.
 * maq_clip_finish renames it to `path` atomically and replaces an existing file. `fps`: images a second, 0.01 to 1000,
 * rounded to 0.001. The caller owns `*clip`: free it with maq_clip_destroy.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT (another extension, `fps` out of range), MAQ_ERROR_UNWRITABLE. */
MAQ_API maq_status maq_clip_create(maq_context* context, const char* path, double fps, maq_clip** clip);

/* Adds an image and does not keep the frame. All images have the size of the first, at least 2 x 2. An odd width or
 * height loses its last column or row. Each image is shown for 1 / fps seconds: timestamps are ignored.
 * One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT (another size, or the clip is finished). MAQ_ERROR_IMAGE_SIZE (too
 * small). MAQ_ERROR_UNSUPPORTED (a depth image; builds for Android). MAQ_ERROR_UNWRITABLE (the disk is full). Blocks
 * while it encodes. */
MAQ_API maq_status maq_clip_add_frame(maq_clip* clip, const maq_frame* frame);

/* Completes the file; nothing can be added afterwards. Only this call tells whether the whole file reached the disk.
 * One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT (nothing was added), MAQ_ERROR_UNWRITABLE (the disk is full; an
 * older file of that name stays). Blocks until the file is on the disk. */
MAQ_API maq_status maq_clip_finish(maq_clip* clip);

/* Frees the clip (NULL is fine) and removes an unfinished file.
 * Once for each clip, from any thread. May block briefly. */
MAQ_API void maq_clip_destroy(maq_clip* clip);

#ifdef __cplusplus
}
#endif

#endif /* MAQUETTE_CLIP_H_ */
