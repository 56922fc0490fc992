/* Frames: one image with its format, strides and time. They come from a source, are decoded from memory, or wrap pixels
 * of the app. */
#ifndef MAQUETTE_FRAME_H_
#define MAQUETTE_FRAME_H_

#include "maquette/context.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Images beyond these limits are refused with MAQ_ERROR_IMAGE_SIZE, before decoding if the file's header has the
 * size. */
#define MAQ_MAX_SIDE_PX 16384
#define MAQ_MAX_PIXELS (64 * 1024 * 1024)

typedef struct maq_frame maq_frame;

/* Rows from top to bottom; 8 bits a channel but for depth. */
typedef enum maq_pixel_format {
  MAQ_PIXEL_RGB8 = 1,    /* one plane, 3 bytes a pixel */
  MAQ_PIXEL_BGR8 = 2,    /* one plane, 3 bytes a pixel */
  MAQ_PIXEL_RGBA8 = 3,   /* one plane, 4 bytes a pixel; alpha is ignored */
  MAQ_PIXEL_GREY8 = 4,   /* one plane, 1 byte a pixel */
  MAQ_PIXEL_NV12 = 5,    /* planes Y [h, w] and UV [ceil(h / 2), 2 * ceil(w / 2)] bytes; BT.601, video range */
  MAQ_PIXEL_YUYV = 6,    /* one plane, Y0 U Y1 V for two pixels; rows of 4 * ceil(w / 2) bytes; BT.601, video range */
  MAQ_PIXEL_DEPTH16 = 7, /* one plane, uint16_t a pixel: millimetres along the optical axis; 0, where nothing is known,
                            and 65535, the end of the range, are unknown */
  MAQ_PIXEL_DEPTH32F = 8 /* one plane, float a pixel: metres along the optical axis, unknown where it is 0, negative,
                            infinite or NaN */
} maq_pixel_format;

/* The zero of a timestamp. */
typedef enum maq_clock {
  MAQ_CLOCK_MEDIA = 1,    /* presentation time: 0 at the start of the file or of the stub */
  MAQ_CLOCK_MONOTONIC = 2 /* the system's monotonic clock (CLOCK_MONOTONIC) at the time of capture */
} maq_clock;

/* Describes a frame: read by maq_frame_wrap, written by maq_frame_get_desc. */
typedef struct maq_frame_desc {
  uint32_t struct_size;
  maq_pixel_format format;
  int32_t width_px;
  int32_t height_px;
  const uint8_t* planes[2]; /* planes[1] only for NV12 */
  size_t stride_bytes[2];   /* from one row to the next, below 2 GiB; 0 in maq_frame_wrap: rows without padding */
  int64_t timestamp_ns;
  maq_clock clock;
  uint64_t sequence; /* number of the frame in its source, from 0; gaps are frames that were dropped */
} maq_frame_desc;

/* An image in planes, as Android's cameras and video decoders give it (YUV_420_888): Y in full size, U and V of every
 * second column and row, ceil(w / 2) x ceil(h / 2). U and V may be planes of their own, or lie in one in turns, in
 * either order. */
typedef struct maq_yuv_image {
  uint32_t struct_size;
  int32_t width_px;
  int32_t height_px;
  const uint8_t* planes[3];      /* Y, U, V */
  size_t size_bytes[3];          /* of the memory there; the last row may end with its last value */
  int32_t stride_bytes[3];       /* from one row to the next */
  int32_t pixel_stride_bytes[3]; /* from one value of a row to the next; of Y 1 */
  int32_t is_full_range;         /* 1 (default): values 0 to 255, as of cameras (JFIF); 0: video range, Y 16 to 235 */
  int32_t rotation_deg;          /* clockwise, from the image to the frame: 0 (default), 90, 180, 270 */
  int64_t timestamp_ns;
  maq_clock clock; /* default MAQ_CLOCK_MONOTONIC */
  uint64_t sequence;
} maq_yuv_image;

/* Called once, when the library no longer needs the pixels of a frame made by maq_frame_wrap, on the thread that
 * released it last. It must not throw: what it throws is caught, and maq_last_error(NULL) has it. */
typedef void (*maq_frame_release_callback)(void* user_data);

/* Fills `desc` with zeros, MAQ_CLOCK_MEDIA and struct_size. `struct_size` is sizeof(maq_frame_desc) of the caller.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_frame_desc_init(maq_frame_desc* desc, uint32_t struct_size);

/* Wraps pixels of the app in a frame, without a copy.
 * The pixels stay the app's: they must not change or be freed until `release_callback` is called with `user_data`, or,
 * with a NULL callback, until the frame has been released. On failure the callback is not called.
 * `*frame` is the caller's: give it back with maq_frame_release.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT (NULL plane, stride shorter than a row or longer than memory),
 * MAQ_ERROR_IMAGE_SIZE, MAQ_ERROR_UNSUPPORTED (format). Does not block. */
MAQ_API maq_status maq_frame_wrap(maq_context* context, const maq_frame_desc* desc,
                                  maq_frame_release_callback release_callback, void* user_data, maq_frame** frame);

/* Fills `image` with zeros, the defaults and struct_size. `struct_size` is sizeof(maq_yuv_image) of the caller.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_yuv_image_init(maq_yuv_image* image, uint32_t struct_size);

/* Makes a copy of an image in planes as a MAQ_PIXEL_NV12 frame, rotated: the planes are not needed afterwards. (Planes
 * that are NV12 in video range already need no copy: maq_frame_wrap.)
 * `*frame` is the caller's: give it back with maq_frame_release.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT (NULL plane, strides or sizes that are not of such an image),
 * MAQ_ERROR_IMAGE_SIZE. Does not block. */
MAQ_API maq_status maq_frame_convert_yuv(maq_context* context, const maq_yuv_image* image, maq_frame** frame);

/* Decodes an image that the app has in memory: a whole JPEG, PNG, WebP, BMP or TIFF file, as from an upload, a network
 * or the assets of an app. It is checked like the file of an image: source, made upright by its EXIF orientation, and
 * becomes MAQ_PIXEL_BGR8 at time 0 of MAQ_CLOCK_MEDIA. `data` is not needed afterwards.
 * `*frame` is the caller's: give it back with maq_frame_release.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT, MAQ_ERROR_UNREADABLE (damaged, truncated or no image),
 * MAQ_ERROR_UNSUPPORTED (another format), MAQ_ERROR_IMAGE_SIZE, MAQ_ERROR_RUNTIME_LIBRARY (libmaquette_files.so is
 * missing, which all but JPEG need). Blocks while it is decoded. */
MAQ_API maq_status maq_frame_decode(maq_context* context, const void* data, size_t size_bytes, maq_frame** frame);

/* Gives the frame back to its pool or to the app (NULL is fine). Pointers into it are invalid afterwards.
 * Once for each frame, from any thread. Does not block. */
MAQ_API void maq_frame_release(maq_frame* frame);

/* Describes the frame; the planes point into it and are valid until it is released. The caller sets desc->struct_size.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_frame_get_desc(const maq_frame* frame, maq_frame_desc* desc);

/* Where a frame's picture comes from. Values never change meaning; new ones are added at the end. */
typedef enum maq_frame_kind {
  MAQ_FRAME_CAPTURED = 1, /* a camera took it, or it was read, wrapped or drawn */
  MAQ_FRAME_PREDICTED = 2 /* made up by a predictor from the frames before it (prediction.h) */
} maq_frame_kind;

typedef struct maq_frame_origin {
  uint32_t struct_size;
  maq_frame_kind kind;
  /* Of a predicted frame, otherwise 0: */
  int64_t horizon_ns; /* from the captured frame that it was made from to its own timestamp */
  int64_t age_ns;     /* since that frame was captured: by the clock until now with MAQ_CLOCK_MONOTONIC, otherwise
                         horizon_ns */
  int64_t captured_timestamp_ns; /* of that frame */
  uint64_t captured_sequence;
} maq_frame_origin;

/* Says whether the frame was captured or made up, and then from how old a frame. Copies by maq_frame_resize keep it.
 * The caller sets origin->struct_size.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_frame_get_origin(const maq_frame* frame, maq_frame_origin* origin);

/* Describes the frame's depth image: of a frame whose pixels are depth those, otherwise what came with the picture,
 * MAQ_PIXEL_DEPTH16, aligned with it (it may be smaller and then covers the same view). Valid until the frame is
 * released. The intrinsics of the source hold for both. The caller sets desc->struct_size.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT, MAQ_ERROR_UNSUPPORTED (the frame has no depth).
 * Does not block. */
MAQ_API maq_status maq_frame_get_depth(const maq_frame* frame, maq_frame_desc* desc);

/* Gets the frame's memory as a dma-buf, which a GPU or an encoder reads without a copy. `*fd` stays the frame's and
 * is valid until the frame is released; duplicate it (dup) to keep it longer. The planes lie in it as in
 * maq_frame_desc.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT, MAQ_ERROR_UNSUPPORTED (the memory is not a device's, or the device
 * does not export it). Does not block. */
MAQ_API maq_status maq_frame_get_dma_buf(const maq_frame* frame, int32_t* fd);

/* Copies the frame's pixels to `pixels` in `format` (RGB8, BGR8, RGBA8 or GREY8), height_px rows of `stride_bytes`
 * (0: rows without padding). `size_bytes` is the size of the caller's memory there.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT (too little memory, a stride too long for any), MAQ_ERROR_UNSUPPORTED
 * (format).
 * Does not block. */
MAQ_API maq_status maq_frame_copy_pixels(const maq_frame* frame, maq_pixel_format format, uint8_t* pixels,
                                         size_t stride_bytes, size_t size_bytes);

/* Makes a copy of the frame in another size, as MAQ_PIXEL_BGR8: area-averaged when it gets smaller, bilinear when it
 * gets larger. The copy keeps timestamp and sequence, not the depth image. `*resized` is the caller's: give it back
 * with maq_frame_release.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT, MAQ_ERROR_IMAGE_SIZE, MAQ_ERROR_UNSUPPORTED (a depth image). Does not
 * block. */
MAQ_API maq_status maq_frame_resize(const maq_frame* frame, int32_t width_px, int32_t height_px, maq_frame** resized);

/* Writes the frame's picture to a file, in the format of the path's extension: PNG (.png), lossless, or JPEG (.jpg,
 * .jpeg) at quality 95. Grey pictures stay grey, others are written as RGB, without alpha. A depth frame becomes a PNG
 * of 16 bits in whole millimetres, 0 where nothing is known or it is over 65.534 m, or a TIFF (.tif, .tiff) of metres
 * as floats; image: with depth_unit=0.001 or depth_unit=1 reads it again. The depth that came with a picture is not
 * written: wrap maq_frame_get_depth for that. The file is written atomically and replaces an existing one; its folder
 * must exist. That of a predicted frame says so at its beginning, and image: and maq_frame_decode read it.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT (another extension), MAQ_ERROR_UNSUPPORTED (depth in builds for
 * Android), MAQ_ERROR_UNWRITABLE, MAQ_ERROR_RUNTIME_LIBRARY (libmaquette_files.so is missing). Blocks while it is
 * written. */
MAQ_API maq_status maq_frame_save(const maq_frame* frame, const char* path);

#ifdef __cplusplus
}
#endif

#endif /* MAQUETTE_FRAME_H_ */
