/* Sources: where frames come from, named by a URI. */
#ifndef MAQUETTE_SOURCE_H_
#define MAQUETTE_SOURCE_H_

#include "maquette/frame.h"

#ifdef __cplusplus
extern "C" {
#endif

/* As a timeout: wait until there is a frame. */
#define MAQ_WAIT_FOREVER (-1)

typedef struct maq_source maq_source;

typedef struct maq_source_config {
  uint32_t struct_size;
  uint32_t pool_size; /* frames the app may hold at once, 1 to 64; default 4 */
} maq_source_config;

typedef struct maq_source_info {
  uint32_t struct_size;
  int32_t width_px;
  int32_t height_px;
  double fps;          /* frames a second; 0 for a single image */
  int64_t frame_count; /* frames in all; -1 when it is not known or has no end */
  int32_t is_live;     /* 1 for a camera: frames that are not fetched in time are lost */
  maq_clock clock;     /* of the timestamps of its frames */
  uint32_t pool_size;  /* frames the app may hold at once */
} maq_source_info;

/* One kind of source that this build knows; all texts are static. */
typedef struct maq_source_scheme {
  uint32_t struct_size;
  const char* name;    /* "image" */
  const char* example; /* "image:photo.jpg" */
  const char* summary; /* one line: what it delivers and its options */
} maq_source_scheme;

/* Fills `config` with the defaults and sets struct_size. `struct_size` is sizeof(maq_source_config) of the caller.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_source_config_init(maq_source_config* config, uint32_t struct_size);

/* Opens a source. `uri` is UTF-8: "image:photo.jpg", "video:clip.mp4", "stub:people?count=2&fps=30&seed=7" or
 * "stub:pattern". "?size=640x480&fps=15" works on each: frames are scaled to that size, and a clip is thinned out to
 * that rate. A '?' that is part of a file name is written %3F, '%' is written %25. `config` may be NULL.
 * `*source` is the caller's, to be given to maq_source_destroy.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT (ill-formed URI or option), MAQ_ERROR_UNSUPPORTED (scheme),
 * MAQ_ERROR_NOT_FOUND, MAQ_ERROR_UNREADABLE, MAQ_ERROR_IMAGE_SIZE. Blocks while files are read. */
MAQ_API maq_status maq_source_create(maq_context* context, const char* uri, const maq_source_config* config,
                                     maq_source** source);

/* Closes the source (NULL is fine). Frames of it that are still held stay valid until they are released.
 * Once for each source, from any thread. May block shortly. */
MAQ_API void maq_source_destroy(maq_source* source);

/* Describes the source. The caller sets info->struct_size.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_source_get_info(const maq_source* source, maq_source_info* info);

/* Takes the next frame. `timeout_ns` bounds the wait for live sources (MAQ_WAIT_FOREVER: no bound); files and stubs
 * deliver at once and ignore it. `*frame` comes from a pool of fixed size: give it back with maq_frame_release soon.
 * One at a time. Errors: MAQ_END_OF_STREAM after the last frame, MAQ_ERROR_POOL_EMPTY when all frames are held,
 * MAQ_ERROR_UNREADABLE when a file ends before its header says, after all readable frames. Blocks while decoding. */
MAQ_API maq_status maq_source_acquire_frame(maq_source* source, int64_t timeout_ns, maq_frame** frame);

/* The kinds of sources of this build: their number, and the one at `index`. The caller sets scheme->struct_size.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT (index out of range). Do not block. */
MAQ_API uint32_t maq_source_scheme_count(void);
MAQ_API maq_status maq_source_get_scheme(uint32_t index, maq_source_scheme* scheme);

#ifdef __cplusplus
}
#endif

#endif /* MAQUETTE_SOURCE_H_ */
