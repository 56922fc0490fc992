/* Sources: cameras, files, recordings and stubs that deliver frames, opened by a URI. */
#ifndef MAQUETTE_SOURCE_H_
#define MAQUETTE_SOURCE_H_

#include "maquette/frame.h"

#ifdef __cplusplus
extern "C" {
#endif

/* A timeout without limit. */
#define MAQ_WAIT_FOREVER (-1)

typedef struct maq_source maq_source;

/* A camera's changes of state. */
typedef enum maq_source_state {
  MAQ_SOURCE_STARTED = 1,
  MAQ_SOURCE_STALLED = 2,      /* no frame for stall_ms; the camera may recover by itself */
  MAQ_SOURCE_LOST = 3,         /* unplugged or broken */
  MAQ_SOURCE_RECONNECTING = 4, /* the source tries to open it every 100 ms, for reconnect_ms */
  MAQ_SOURCE_RECONNECTED = 5   /* frames come again */
} maq_source_state;

/* Receives a change of state on a thread of the source; it must return promptly and must not destroy the source.
 * `reason` is valid during the call. maq_source_destroy waits for a call that is running; none begins after it. */
typedef void (*maq_source_state_callback)(void* user_data, maq_source_state state, const char* reason);

typedef struct maq_source_config {
  uint32_t struct_size;
  uint32_t frame_pool_size; /* frames the app may hold at once, 1 to 64; default 4 */
  /* For cameras (is_live): */
  /* Frames that wait for the app, 1 to 64; a new one replaces the oldest; default 1: only the newest waits */
  uint32_t queue_length;
  int32_t stall_ms;     /* after this time without a frame the camera counts as stalled, 50 to 60000; default 2000 */
  int32_t reconnect_ms; /* how long to wait for a lost camera, 0 to 86400000; default 30000 */
  maq_source_state_callback state_callback; /* may be NULL */
  void* state_user_data;                    /* passed to state_callback */
  /* For sources other than cameras: */
  int32_t real_time; /* 1: clips, recordings and stubs play in real time like a camera (is_live), unless the URI has
                        live=0; 0 (default): frames come as fast as they are acquired, unless it has live=1 */
  int32_t loop; /* 1: a source that plays in real time starts again at its end, unless the URI has loop=0; default 0 */
  int32_t max_side_px; /* larger pictures are scaled down to this longer side; 0 (default): they are not scaled */
} maq_source_config;

typedef struct maq_source_info {
  uint32_t struct_size;
  int32_t width_px;
  int32_t height_px;
  double fps;                   /* frames a second; 0 for a single image */
  int64_t frame_count;          /* total number of frames; -1 if unknown or endless */
  int32_t is_live;              /* 1 for a camera: frames that are not acquired in time are lost */
  maq_clock clock;              /* of the timestamps of its frames */
  uint32_t frame_pool_size;     /* frames the app may hold at once */
  uint64_t dropped_frame_count; /* frames lost so far: by the camera, or not acquired in time */
} maq_source_info;

/* How a camera maps directions to pixels, in the convention of OpenCV: x to the right, y down, z forward; the centre of
 * the top left pixel is (0, 0). With x' = x / z and y' = y / z, distorted by the rational model
 * (k1, k2, p1, p2, k3, k4, k5, k6), a point appears at (fx x' + cx, fy y' + cy). This struct never grows. */
typedef struct maq_intrinsics {
  int32_t width_px; /* of the picture that the other numbers refer to */
  int32_t height_px;
  double fx_px, fy_px;  /* focal lengths, positive */
  double cx_px, cy_px;  /* the principal point; may lie outside the picture */
  double distortion[8]; /* all 0: none */
} maq_intrinsics;

/* The controls of a camera. A device has some of them. */
typedef enum maq_control {
  MAQ_CONTROL_AUTO_EXPOSURE = 1,      /* 1: the device sets exposure and, on most devices, gain; 0: manual */
  MAQ_CONTROL_EXPOSURE = 2,           /* microseconds */
  MAQ_CONTROL_GAIN = 3,               /* in units of the device */
  MAQ_CONTROL_AUTO_FOCUS = 4,         /* 1 or 0 */
  MAQ_CONTROL_FOCUS = 5,              /* in units of the device */
  MAQ_CONTROL_AUTO_WHITE_BALANCE = 6, /* 1 or 0 */
  MAQ_CONTROL_WHITE_BALANCE = 7,      /* kelvin */
  MAQ_CONTROL_BRIGHTNESS = 8          /* in units of the device */
} maq_control;

typedef struct maq_control_info {
  uint32_t struct_size;
  double min, max, step; /* values are rounded to the nearest step */
  double default_value;  /* of the device */
  double value;          /* now */
} maq_control_info;

/* A kind of source of this build. The texts are static. */
typedef struct maq_source_scheme {
  uint32_t struct_size;
  const char* name;    /* "image" */
  const char* example; /* "image:photo.jpg" */
  const char* summary; /* one line: what it delivers and its options */
  int32_t is_camera;   /* 1: always live; 0: live only with "?live=1" or real_time */
} maq_source_scheme;

/* Fills `config` with the defaults and sets struct_size. `struct_size` is sizeof(maq_source_config) of the caller.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_source_config_init(maq_source_config* config, uint32_t struct_size);

/* Opens a source. `uri` is UTF-8: "image:photo.jpg", "video:clip.mp4", "rec:take.maqrec", "stub:people?count=2&seed=7",
 * "stub:pattern", "stub:solids", "v4l2:/dev/video0" or "v4l2:0", "libcamera:0", "depthai:", and on Android
 * "android:back" or "android:0". "file:clip.mp4" chooses among the first three by the file's content, "camera:" opens
 * the first camera that can be opened. Without a scheme it is the path of a file or a camera, "clip.mp4" or
 * "/dev/video0", as it is: no options.
 * An image may also come out of a pipe (/dev/stdin); the other files are regular files.
 * "?size=640x480&fps=15" works with each: frames are scaled to that size, frames of a clip are dropped down to that
 * rate; a camera uses the nearest mode that it offers, which maq_source_get_info returns. For cameras, "format=MJPG"
 * selects a pixel format and "exposure=10000&focus=auto" sets controls. "live=1" plays a file or stub in real time like
 * a camera. "depth_unit=0.001" reads an image as depth, and is the unit of "v4l2:0?format=Z16"; "fov=60" (degrees) or
 * "fx=380&fy=381&cx=318&cy=242" (pixels) give the intrinsics of an image or a camera. Faults such as "drop=0.1" or
 * "unplug=3s@5s" can be injected into any source (docs/cameras/simulated.md). Behind a scheme, write a '?' of a file
 * name as %3F and a '%' as %25. `config` may be NULL. `*source` is the caller's, to be given to maq_source_destroy.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT (ill-formed URI or option), MAQ_ERROR_UNSUPPORTED (scheme, format of
 * an image), MAQ_ERROR_NOT_FOUND, MAQ_ERROR_UNREADABLE, MAQ_ERROR_IMAGE_SIZE; for cameras MAQ_ERROR_DEVICE_LOST,
 * MAQ_ERROR_BUSY, MAQ_ERROR_NO_PERMISSION, MAQ_ERROR_RUNTIME_LIBRARY too. Blocks while files are read and devices
 * start. */
MAQ_API maq_status maq_source_create(maq_context* context, const char* uri, const maq_source_config* config,
                                     maq_source** source);

/* Stops the source for good: a call of maq_source_acquire_frame that waits in another thread, and every later one,
 * returns MAQ_CANCELLED, and no state callback begins any more. A camera is closed as soon as it answers. Frames that
 * are held stay valid.
 * Any thread, also in a state callback. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_source_stop(maq_source* source);

/* Stops the source as maq_source_stop does and frees it (NULL is fine). Frames of it that are still held stay valid
 * until they are released. A call of maq_source_acquire_frame that waits in another thread returns MAQ_CANCELLED first;
 * no other call may run, and none may begin.
 * Once for each source, from any thread. Blocks for at most 50 ms, also when a device hangs, while a state callback
 * runs, and while another thread decodes a frame of the source. */
MAQ_API void maq_source_destroy(maq_source* source);

/* Describes the source. The caller sets info->struct_size.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_source_get_info(const maq_source* source, maq_source_info* info);

/* Acquires the next frame; of a camera, the oldest one that waits. A camera's frame lies in memory of the device, which
 * has few buffers and drops frames while the app holds them all. `timeout_ns` bounds the wait for live sources
 * (MAQ_WAIT_FOREVER: no bound); files and stubs deliver at once and ignore it. `*frame` comes from a pool of
 * frame_pool_size: give it back promptly with maq_frame_release.
 * One at a time. Errors: MAQ_END_OF_STREAM after the last frame, MAQ_TIMEOUT, MAQ_CANCELLED (the source is stopped),
 * MAQ_ERROR_DEVICE_LOST, MAQ_ERROR_POOL_EMPTY when all frames are held, MAQ_ERROR_UNREADABLE when a clip ends before
 * its header says, after all readable frames, or for a damaged frame of a recording, which is skipped; MAQ_ERROR_BUSY
 * while a concealer takes its frames. Blocks while decoding. */
MAQ_API maq_status maq_source_acquire_frame(maq_source* source, int64_t timeout_ns, maq_frame** frame);

/* Gets a file descriptor for poll, epoll or a looper of Android: it is readable while maq_source_acquire_frame would
 * not wait, because a frame waits, or because the source has ended, failed or was stopped. Acquire with a timeout of 0
 * then; a damaged frame is dropped, and the call returns MAQ_TIMEOUT. It is the source's: do not read, write or close
 * it; maq_source_destroy closes it.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT, MAQ_ERROR_UNSUPPORTED (not live: frames need no waiting),
 * MAQ_ERROR_OUT_OF_MEMORY (the process has no descriptor left). Does not block. */
MAQ_API maq_status maq_source_get_event_fd(maq_source* source, int32_t* fd);

/* Gets the camera's intrinsics.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT, MAQ_ERROR_UNSUPPORTED (they are unknown). Does not block. */
MAQ_API maq_status maq_source_get_intrinsics(const maq_source* source, maq_intrinsics* intrinsics);

/* Gets the value and the range of a control. The caller sets info->struct_size.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT, MAQ_ERROR_UNSUPPORTED (the device does not have it), MAQ_ERROR_BUSY
 * (not now), MAQ_ERROR_DEVICE_LOST (also while the camera is lost). Blocks while the device answers. */
MAQ_API maq_status maq_source_get_control(maq_source* source, maq_control control, maq_control_info* info);

/* Sets a control. A manual exposure, gain, focus or white balance switches off its automatic mode. Controls are set
 * again when a lost camera is reconnected.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT (out of range), MAQ_ERROR_UNSUPPORTED (the device does not have it),
 * MAQ_ERROR_BUSY (not now), MAQ_ERROR_DEVICE_LOST (also while the camera is lost). Blocks while the device answers. */
MAQ_API maq_status maq_source_set_control(maq_source* source, maq_control control, double value);

/* Moves to the first frame at `time_ns` after the source's first frame, or later: the next call acquires it.
 * One at a time, together with maq_source_acquire_frame. Errors: MAQ_ERROR_INVALID_ARGUMENT (negative),
 * MAQ_ERROR_UNSUPPORTED (only clips, recordings and stubs can). Does not block: the next call searches. */
MAQ_API maq_status maq_source_seek(maq_source* source, int64_t time_ns);

/* Get the number of kinds of sources of this build, and the kind at `index`. The caller sets scheme->struct_size.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT (index out of range). Do not block. */
MAQ_API uint32_t maq_source_get_scheme_count(void);
MAQ_API maq_status maq_source_get_scheme(uint32_t index, maq_source_scheme* scheme);

/* The cameras that were connected when the list was created. */
typedef struct maq_camera_list maq_camera_list;

/* A connected camera. The texts stay valid until the list is destroyed. */
typedef struct maq_camera_info {
  uint32_t struct_size;
  const char* uri;     /* for maq_source_create: "v4l2:/dev/video0" */
  const char* name;    /* the device's own name; "" when it cannot be opened */
  const char* bus;     /* where it is plugged in */
  maq_status status;   /* MAQ_OK, or the reason for which it cannot be opened now */
  const char* problem; /* the status in a sentence, and what to do */
  uint32_t mode_count;
} maq_camera_info;

/* A format, size and rate that a camera offers. */
typedef struct maq_camera_mode {
  uint32_t struct_size;
  char format[8];    /* four letters, as the device calls it: "YUYV", "MJPG" */
  int32_t is_usable; /* 1 if this build supports the format */
  int32_t width_px;  /* the largest size, if the device offers every size up to it */
  int32_t height_px;
  double fps; /* the highest rate; 0 if unknown */
} maq_camera_mode;

/* Lists the connected cameras; the list may be empty. `*list` is the caller's, to be given to
 * maq_camera_list_destroy.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Blocks while devices answer. */
MAQ_API maq_status maq_camera_list_create(maq_context* context, maq_camera_list** list);

/* Frees the list (NULL is fine). Once for each list, from any thread. Does not block. */
MAQ_API void maq_camera_list_destroy(maq_camera_list* list);

/* Returns the number of cameras; 0 for NULL. Any thread. Does not fail or block. */
MAQ_API uint32_t maq_camera_list_get_count(const maq_camera_list* list);

/* Get the camera at `index`, and of its modes the one at `mode_index`. The caller sets struct_size of `info` and
 * `mode`.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT (also an index out of range). Do not block. */
MAQ_API maq_status maq_camera_list_get_camera(const maq_camera_list* list, uint32_t index, maq_camera_info* info);
MAQ_API maq_status maq_camera_list_get_mode(const maq_camera_list* list, uint32_t index, uint32_t mode_index,
                                            maq_camera_mode* mode);

#ifdef __cplusplus
}
#endif

#endif /* MAQUETTE_SOURCE_H_ */
