/* Frames: one image with its format, strides, time and camera. A source delivers frames. An app can also decode them
 * from memory, or wrap its own pixels. */
#ifndef MAQUETTE_FRAME_H_
#define MAQUETTE_FRAME_H_

#include "maquette/context.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Larger images are refused with MAQ_ERROR_IMAGE_SIZE, before decoding if the file's header states the size. */
#define MAQ_MAX_SIDE_PX 16384
#define MAQ_MAX_PIXELS (64 * 1024 * 1024)

typedef struct maq_frame maq_frame;

/* Rows go from top to bottom. Colour formats have 8 bits a channel. */
typedef enum maq_pixel_format {
  MAQ_PIXEL_RGB8 = 1,    /* one plane, 3 bytes a pixel */
  MAQ_PIXEL_BGR8 = 2,    /* one plane, 3 bytes a pixel */
  MAQ_PIXEL_RGBA8 = 3,   /* one plane, 4 bytes a pixel; alpha is ignored */
  MAQ_PIXEL_GREY8 = 4,   /* one plane, 1 byte a pixel */
  MAQ_PIXEL_NV12 = 5,    /* planes Y [h, w] and UV [ceil(h / 2), 2 * ceil(w / 2)] bytes; BT.601, video range */
  MAQ_PIXEL_YUYV = 6,    /* one plane, Y0 U Y1 V for two pixels; rows of 4 * ceil(w / 2) bytes; BT.601, video range */
  MAQ_PIXEL_DEPTH16 = 7, /* one plane, uint16_t a pixel: millimetres along the optical axis; 0 and 65535 mean unknown */
  MAQ_PIXEL_DEPTH32F = 8 /* one plane, float a pixel: metres along the optical axis; 0, negative, infinite and NaN mean
                            unknown */
} maq_pixel_format;

/* The zero of a timestamp. */
typedef enum maq_clock {
  MAQ_CLOCK_MEDIA = 1,    /* presentation time: 0 at the start of the file or of the stub */
  MAQ_CLOCK_MONOTONIC = 2 /* the system's monotonic clock (CLOCK_MONOTONIC) at the time of capture */
} maq_clock;

/* A camera without its pose, in the convention of OpenCV: x right, y down, z forward. The centre of the top left pixel
 * is (0, 0). A point (x, y, z) with x' = x / z and y' = y / z appears at (fx x' + cx, fy y' + cy). Before that, x' and
 * y' are distorted by the rational model (k1, k2, p1, p2, k3, k4, k5, k6). This struct never grows. */
typedef struct maq_intrinsics {
  int32_t width_px; /* size of the image that the other numbers refer to */
  int32_t height_px;
  double fx_px, fy_px;  /* focal lengths, positive */
  double cx_px, cy_px;  /* the principal point; may lie outside the image */
  double distortion[8]; /* all 0: no distortion */
} maq_intrinsics;

/* Describes a frame: read by maq_frame_wrap, written by maq_frame_get_desc and maq_frame_get_depth. */
typedef struct maq_frame_desc {
  uint32_t struct_size;
  maq_pixel_format format;
  int32_t width_px;
  int32_t height_px;
  const uint8_t* planes[2]; /* planes[1] is used only by NV12 */
  size_t stride_bytes[2];   /* from one row to the next, below 2 GiB; 0 in maq_frame_wrap: rows without padding */
  int64_t timestamp_ns;
  maq_clock clock;
  uint64_t sequence;         /* number of the frame in its source, from 0; a gap means dropped frames */
  maq_intrinsics intrinsics; /* camera of this image, which has the same size; width_px 0 (default): unknown */
} maq_frame_desc;

/* An image in three planes (YUV_420_888), as Android's cameras and video decoders deliver it. Y has the full size. U
 * and V have every second column and row: ceil(w / 2) x ceil(h / 2). U and V may be separate planes. They may also
 * share one plane and alternate in it, in either order. */
typedef struct maq_yuv_image {
  uint32_t struct_size;
  int32_t width_px;
  int32_t height_px;
  const uint8_t* planes[3];      /* Y, U, V */
  size_t size_bytes[3];          /* size of each plane's memory; the last row may end with its last value */
  int32_t stride_bytes[3];       /* from one row to the next */
  int32_t pixel_stride_bytes[3]; /* from one value of a row to the next; 1 for Y */
  int32_t is_video_range;        /* 0 (default): values 0 to 255, as from cameras (JFIF); 1: Y from 16 to 235 */
  int32_t rotation_deg;          /* clockwise, from the image to the frame: 0 (default), 90, 180, 270 */
  int64_t timestamp_ns;
  maq_clock clock; /* default MAQ_CLOCK_MONOTONIC */
  uint64_t sequence;
} maq_yuv_image;

/* Called once, when the library no longer needs the pixels of a frame made by maq_frame_wrap. It runs on the thread
 * that released the frame last. It must not throw. An exception is caught, and maq_last_error(NULL) returns its text.
 */
typedef void (*maq_frame_release_callback)(void* user_data);

/* Fills `desc` with zeros, MAQ_CLOCK_MEDIA and struct_size. `struct_size` is sizeof(maq_frame_desc) of the caller.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_frame_desc_init(maq_frame_desc* desc, uint32_t struct_size);

/* Wraps pixels of the app in a frame, without a copy. For depth of your own camera, set desc->intrinsics.
 * The pixels stay the app's. Do not change or free them before `release_callback` is called with `user_data`. With a
 * NULL callback, keep them until the frame has been released. On failure the callback is not called.
 * The caller owns `*frame`: release it with maq_frame_release.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT (NULL plane, stride shorter than a row or longer than memory,
 * intrinsics of another size), MAQ_ERROR_IMAGE_SIZE, MAQ_ERROR_UNSUPPORTED (format). Does not block. */
MAQ_API maq_status maq_frame_wrap(maq_context* context, const maq_frame_desc* desc,
                                  maq_frame_release_callback release_callback, void* user_data, maq_frame** frame);

/* Fills `image` with zeros, the defaults and struct_size. `struct_size` is sizeof(maq_yuv_image) of the caller.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_yuv_image_init(maq_yuv_image* image, uint32_t struct_size);

/* Copies an image in three planes to a MAQ_PIXEL_NV12 frame, and rotates it. The planes may be freed afterwards. Planes
 * that are NV12 in video range need no copy: use maq_frame_wrap.
 * The caller owns `*frame`: release it with maq_frame_release.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT (NULL plane, strides or sizes that do not fit such an image),
 * MAQ_ERROR_IMAGE_SIZE. Does not block. */
MAQ_API maq_status maq_frame_convert_yuv(maq_context* context, const maq_yuv_image* image, maq_frame** frame);

/* Decodes an image file in memory: JPEG, PNG, WebP, BMP or TIFF. The result is MAQ_PIXEL_BGR8 at time 0 of
 * MAQ_CLOCK_MEDIA, made upright by its EXIF orientation. `data` may be freed afterwards.
 * The caller owns `*frame`: release it with maq_frame_release.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT, MAQ_ERROR_UNREADABLE (damaged, truncated or no image),
 * MAQ_ERROR_UNSUPPORTED (another format), MAQ_ERROR_IMAGE_SIZE. Blocks while it decodes. */
MAQ_API maq_status maq_frame_decode(maq_context* context, const void* data, size_t size_bytes, maq_frame** frame);

/* Returns the frame to its pool or to the app (NULL is fine). Pointers into it are invalid afterwards.
 * Once for each frame, from any thread. Does not block. */
MAQ_API void maq_frame_release(maq_frame* frame);

/* Describes the frame. The planes point into the frame and are valid until it is released. Frames of a source carry the
 * source's intrinsics if these are known. The caller sets desc->struct_size.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_frame_get_desc(const maq_frame* frame, maq_frame_desc* desc);

/* The origin of a frame's pixels. Values never change meaning; new ones are added at the end. */
typedef enum maq_frame_kind {
  MAQ_FRAME_CAPTURED = 1, /* taken by a camera, read from a file, wrapped or rendered */
  MAQ_FRAME_PREDICTED = 2 /* predicted from earlier frames (prediction.h) */
} maq_frame_kind;

typedef struct maq_frame_origin {
  uint32_t struct_size;
  maq_frame_kind kind;
  /* The rest is 0 for a captured frame. */
  int64_t horizon_ns; /* from the captured frame that the prediction is based on to the predicted frame's timestamp */
  int64_t age_ns;     /* since that frame was captured: until now with MAQ_CLOCK_MONOTONIC, otherwise horizon_ns */
  int64_t captured_timestamp_ns; /* of the captured frame */
  uint64_t captured_sequence;
} maq_frame_origin;

/* Tells whether the frame was captured or predicted, and how old the captured frame behind a prediction is. Copies by
 * maq_frame_resize keep the origin. The caller sets origin->struct_size.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_frame_get_origin(const maq_frame* frame, maq_frame_origin* origin);

/* Describes the frame's depth image, with intrinsics for its size. For a depth frame these are its own pixels. For a
 * colour frame it is the aligned MAQ_PIXEL_DEPTH16 image of the same view, which may be smaller. The planes are valid
 * until the frame is released. The caller sets desc->struct_size.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT, MAQ_ERROR_UNSUPPORTED (the frame has no depth). Does not block. */
MAQ_API maq_status maq_frame_get_depth(const maq_frame* frame, maq_frame_desc* desc);

/* Gets the frame's memory as a dma-buf, which a GPU or an encoder reads without a copy. `*fd` stays the frame's and is
 * valid until the frame is released. Duplicate it (dup) to keep it longer. maq_frame_get_desc describes the planes in
 * it.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT, MAQ_ERROR_UNSUPPORTED (the memory is not a device's, or the device
 * does not export it). Does not block. */
MAQ_API maq_status maq_frame_get_dma_buf(const maq_frame* frame, int32_t* fd);

/* Copies the frame's pixels to `pixels` in `format` (RGB8, BGR8, RGBA8 or GREY8), height_px rows of `stride_bytes`
 * (0: rows without padding). `size_bytes` is the capacity of `pixels`.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT (too little memory, a stride longer than any memory),
 * MAQ_ERROR_UNSUPPORTED (format). Does not block. */
MAQ_API maq_status maq_frame_copy_pixels(const maq_frame* frame, maq_pixel_format format, uint8_t* pixels,
                                         size_t stride_bytes, size_t size_bytes);

/* Copies the frame to another size, as MAQ_PIXEL_BGR8. It averages areas when the image gets smaller and interpolates
 * bilinearly when it gets larger. The copy keeps timestamp and sequence, and its intrinsics fit the new size. It has no
 * depth image. The caller owns `*resized`: release it with maq_frame_release.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT, MAQ_ERROR_IMAGE_SIZE, MAQ_ERROR_UNSUPPORTED (a depth image). Does not
 * block. */
MAQ_API maq_status maq_frame_resize(const maq_frame* frame, int32_t width_px, int32_t height_px, maq_frame** resized);

/* Writes the frame to an image file. The extension of `path` chooses the format. The file is written atomically and
 * replaces an existing one. Its folder must exist. A predicted frame is marked in the file, and reading restores the
 * mark.
 *   colour: .png (lossless), or .jpg and .jpeg at quality 95; grey stays grey, others become RGB without alpha
 *   depth:  .png, 16 bits in whole millimetres, 0 for unknown and beyond 65.534 m (image: with depth_unit=0.001), or
 *           .tif and .tiff, metres as floats (image: with depth_unit=1)
 * The depth that came with a colour image is not written. To write it, wrap the result of maq_frame_get_depth.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT (another extension), MAQ_ERROR_UNSUPPORTED (depth in builds for
 * Android), MAQ_ERROR_UNWRITABLE. Blocks while it
 * writes. */
MAQ_API maq_status maq_frame_save(const maq_frame* frame, const char* path);

#ifdef __cplusplus
}
#endif

#endif /* MAQUETTE_FRAME_H_ */
