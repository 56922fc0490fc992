/* Sources: cameras, files, recordings and stubs that deliver frames. A URI opens one. */
#ifndef MAQUETTE_SOURCE_H_
#define MAQUETTE_SOURCE_H_

#include "maquette/frame.h"

#ifdef __cplusplus
extern "C" {
#endif

/* A timeout without limit. */
#define MAQ_WAIT_FOREVER (-1)

/* For maq_source_config.reconnect_ms: a lost camera ends the source at once. */
#define MAQ_NO_RECONNECT (-1)

typedef struct maq_source maq_source;

/* The state of a camera. */
typedef enum maq_source_state {
  MAQ_SOURCE_STARTED = 1,
  MAQ_SOURCE_STALLED = 2,      /* no frame for stall_ms; the camera may recover by itself */
  MAQ_SOURCE_LOST = 3,         /* unplugged or broken */
  MAQ_SOURCE_RECONNECTING = 4, /* the source tries to open the camera every 100 ms, for reconnect_ms */
  MAQ_SOURCE_RECONNECTED = 5   /* frames come again */
} maq_source_state;

/* Receives a change of state on a thread of the source. It must return promptly and must not destroy the source.
 * `reason` is valid during the call. maq_source_destroy waits for a running call; no call begins after it. */
typedef void (*maq_source_state_callback)(void* user_data, maq_source_state state, const char* reason);

typedef struct maq_source_config {
  uint32_t struct_size;
  uint32_t frame_pool_size; /* frames the app may hold at once, 1 to 64; 0 (default): 4 */
  /* For cameras (is_live): */
  uint32_t queue_length; /* frames that wait for the app, 1 to 64; a new one replaces the oldest; 0 (default): 1 */
  int32_t stall_ms;      /* a camera without a frame for this time counts as stalled, 50 to 60000; 0 (default): 2000 */
  int32_t reconnect_ms;  /* how long to wait for a lost camera, 1 to 86400000; 0 (default): 30000; or
                            MAQ_NO_RECONNECT */
  maq_source_state_callback state_callback; /* may be NULL */
  void* state_user_data;                    /* passed to state_callback */
  /* For sources other than cameras: */
  int32_t real_time; /* 1: clips, recordings and stubs play in real time like a camera (is_live), unless the URI has
                        live=0. 0 (default): frames come as fast as they are acquired, unless the URI has live=1. */
  int32_t loop; /* 1: a source that plays in real time starts again at its end, unless the URI has loop=0; default 0 */
  int32_t max_side_px; /* larger images are scaled down to this longer side; 0 (default): no limit */
} maq_source_config;

typedef struct maq_source_info {
  uint32_t struct_size;
  int32_t width_px;
  int32_t height_px;
  double fps;                   /* frames a second; 0 for a single image */
  int64_t frame_count;          /* total number of frames; -1 if unknown or endless */
  int32_t is_live;              /* 1 for a camera: frames that are not acquired in time are lost */
  maq_clock clock;              /* clock of the frames' timestamps */
  uint32_t frame_pool_size;     /* frames the app may hold at once */
  uint64_t dropped_frame_count; /* frames lost so far: by the camera, or not acquired in time */
} maq_source_info;

/* The controls of a camera. A device has some of them. */
typedef enum maq_source_control {
  MAQ_SOURCE_CONTROL_AUTO_EXPOSURE = 1,      /* 1: the device sets exposure and, on most devices, gain; 0: manual */
  MAQ_SOURCE_CONTROL_EXPOSURE = 2,           /* microseconds */
  MAQ_SOURCE_CONTROL_GAIN = 3,               /* in units of the device */
  MAQ_SOURCE_CONTROL_AUTO_FOCUS = 4,         /* 1 or 0 */
  MAQ_SOURCE_CONTROL_FOCUS = 5,              /* in units of the device */
  MAQ_SOURCE_CONTROL_AUTO_WHITE_BALANCE = 6, /* 1 or 0 */
  MAQ_SOURCE_CONTROL_WHITE_BALANCE = 7,      /* kelvin */
  MAQ_SOURCE_CONTROL_BRIGHTNESS = 8          /* in units of the device */
} maq_source_control;

typedef struct maq_source_control_info {
  uint32_t struct_size;
  double min, max, step; /* values are rounded to the nearest step */
  double default_value;  /* default of the device */
  double value;          /* current value */
} maq_source_control_info;

/* A kind of source in this build. The texts are static. */
typedef struct maq_source_scheme {
  uint32_t struct_size;
  const char* name;    /* "image" */
  const char* example; /* "image:photo.jpg" */
  const char* summary; /* one line: frames and options of this kind */
  int32_t is_camera;   /* 1: always live; 0: live only with "?live=1" or real_time */
} maq_source_scheme;

/* Fills `config` with the defaults and sets struct_size. `struct_size` is sizeof(maq_source_config) of the caller.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_source_config_init(maq_source_config* config, uint32_t struct_size);

/* Opens a source. `uri` is UTF-8. `config` may be NULL. The caller owns `*source`: free it with maq_source_destroy.
 *
 *   files     "image:photo.jpg", "video:clip.mp4", "rec:take.maqrec"; "file:clip.mp4" detects the kind by content
 *   cameras   "v4l2:/dev/video0", "v4l2:0", "libcamera:0", "depthai:", on Android "android:back" or "android:0";
 *             "camera:" opens the first camera that works
 *   stubs     "stub:people?count=2&seed=7", "stub:pattern", "stub:solids"
 *   a path    "clip.mp4", "/dev/video0": a file or a camera without options
 *
 * An image may also come from a pipe (/dev/stdin). Other files must be regular files. Options follow "?":
 *
 *   size=640x480, fps=15   scale frames, and drop frames of a clip; a camera uses its nearest mode
 *   format=MJPG            the pixel format of a camera
 *   exposure=10000&focus=auto   controls of a camera
 *   live=1                 play a file or a stub in real time like a camera
 *   depth_unit=0.001       read an image as depth; the unit in metres, also for "v4l2:0?format=Z16"
 *   fov=60                 horizontal field of view in degrees; or fx=380&fy=381&cx=318&cy=242 in pixels: the
 *                          intrinsics of an image or a camera
 *   drop=0.1, unplug=3s@5s      faults for tests (docs/reference/cameras/simulated.md)
 *
 * After a scheme, write '?' in a file name as %3F and '%' as %25.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT (ill-formed URI or option), MAQ_ERROR_UNSUPPORTED (scheme, format of
 * an image), MAQ_ERROR_NOT_FOUND, MAQ_ERROR_UNREADABLE, MAQ_ERROR_IMAGE_SIZE; for cameras also MAQ_ERROR_DEVICE_LOST,
 * MAQ_ERROR_BUSY, MAQ_ERROR_NO_PERMISSION, MAQ_ERROR_RUNTIME_LIBRARY. Blocks while files are read and devices start. */
MAQ_API maq_status maq_source_create(maq_context* context, const char* uri, const maq_source_config* config,
                                     maq_source** source);

/* Stops the source for good. A waiting maq_source_acquire_frame and all later calls return MAQ_CANCELLED. No further
 * state callback begins. A camera is closed as soon as it answers. Frames that the app holds stay valid.
 * Any thread, also in a state callback. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_source_stop(maq_source* source);

/* Stops the source and frees it (NULL is fine). Frames that the app holds stay valid until they are released. A
 * maq_source_acquire_frame that waits in another thread returns MAQ_CANCELLED first. No other call may run or begin.
 * Once for each source, from any thread. Blocks for at most 50 ms, even if a device hangs, a state callback runs, or
 * another thread decodes a frame of the source. */
MAQ_API void maq_source_destroy(maq_source* source);

/* Describes the source. The caller sets info->struct_size.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_source_get_info(const maq_source* source, maq_source_info* info);

/* Acquires the next frame; for a camera, the oldest one that waits. The frame carries the source's intrinsics if these
 * are known. `timeout_ns` limits the wait for live sources (MAQ_WAIT_FOREVER: no limit). Files and stubs ignore it.
 * `*frame` comes from a pool of frame_pool_size: release it promptly with maq_frame_release. A camera's frame lies in
 * memory of the device, which has few buffers. The camera drops frames while the app holds all of them.
 * One at a time. Errors: MAQ_END_OF_STREAM (after the last frame), MAQ_TIMEOUT, MAQ_CANCELLED (the source is stopped),
 * MAQ_ERROR_DEVICE_LOST, MAQ_ERROR_POOL_EMPTY (the app holds all frames). MAQ_ERROR_UNREADABLE: a clip ends before its
 * header says, after all readable frames; or a damaged frame of a recording is skipped. MAQ_ERROR_BUSY (a concealer
 * takes the frames). Blocks while decoding. */
MAQ_API maq_status maq_source_acquire_frame(maq_source* source, int64_t timeout_ns, maq_frame** frame);

/* Gets a file descriptor for poll, epoll or an Android looper. It is readable when maq_source_acquire_frame would not
 * wait: a frame waits, or the source has ended, failed or was stopped. Then acquire with a timeout of 0. A damaged
 * frame is dropped, and that call returns MAQ_TIMEOUT. The descriptor stays the source's: do not read, write or close
 * it. On Windows it is the value of an event HANDLE, for WaitForSingleObject: (HANDLE)(intptr_t)fd.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT, MAQ_ERROR_UNSUPPORTED (not live: frames need no waiting),
 * MAQ_ERROR_OUT_OF_MEMORY (the process has no descriptor left). Does not block. */
MAQ_API maq_status maq_source_get_event_fd(maq_source* source, int32_t* fd);

/* Gets the camera's intrinsics. Frames carry them, too (maq_frame_desc).
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT, MAQ_ERROR_UNSUPPORTED (they are unknown). Does not block. */
MAQ_API maq_status maq_source_get_intrinsics(const maq_source* source, maq_intrinsics* intrinsics);

/* Gets the value and the range of a control. The caller sets info->struct_size.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT, MAQ_ERROR_UNSUPPORTED (the device does not have it), MAQ_ERROR_BUSY
 * (not now), MAQ_ERROR_DEVICE_LOST (also while the camera is lost). Blocks while the device answers. */
MAQ_API maq_status maq_source_get_control(maq_source* source, maq_source_control control,
                                          maq_source_control_info* info);

/* Sets a control. A manual exposure, gain, focus or white balance switches off its automatic mode. The source sets the
 * controls again when it reconnects a lost camera.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT (out of range), MAQ_ERROR_UNSUPPORTED (the device does not have it),
 * MAQ_ERROR_BUSY (not now), MAQ_ERROR_DEVICE_LOST (also while the camera is lost). Blocks while the device answers. */
MAQ_API maq_status maq_source_set_control(maq_source* source, maq_source_control control, double value);

/* Moves to the first frame at or after `time_ns`, counted from the source's first frame. The next call acquires it.
 * One at a time, together with maq_source_acquire_frame. Errors: MAQ_ERROR_INVALID_ARGUMENT (negative),
 * MAQ_ERROR_UNSUPPORTED (not a clip, a recording or a stub). Does not block: the next acquire searches. */
MAQ_API maq_status maq_source_seek(maq_source* source, int64_t time_ns);

/* Get the number of kinds of sources in this build, and the kind at `index`. The caller sets scheme->struct_size.
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
  const char* bus;     /* the port that the camera is plugged into */
  maq_status status;   /* MAQ_OK, or the reason why the camera cannot be opened now */
  const char* problem; /* the status in a sentence, with the remedy */
  uint32_t mode_count;
} maq_camera_info;

/* A format, size and rate that a camera offers. */
typedef struct maq_camera_mode {
  uint32_t struct_size;
  char format[8];    /* four letters, the device's name for it: "YUYV", "MJPG" */
  int32_t is_usable; /* 1 if this build supports the format */
  int32_t width_px;  /* the largest size, if the device offers every size up to it */
  int32_t height_px;
  double fps; /* the highest rate; 0 if unknown */
} maq_camera_mode;

/* Lists the connected cameras; the list may be empty. The caller owns `*list`: free it with maq_camera_list_destroy.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Blocks while devices answer. */
MAQ_API maq_status maq_camera_list_create(maq_context* context, maq_camera_list** list);

/* Frees the list (NULL is fine). Once for each list, from any thread. Does not block. */
MAQ_API void maq_camera_list_destroy(maq_camera_list* list);

/* Returns the number of cameras; 0 for NULL. Any thread. Does not fail or block. */
MAQ_API uint32_t maq_camera_list_get_count(const maq_camera_list* list);

/* Get the camera at `index`, and its mode at `mode_index`. The caller sets struct_size of `info` and `mode`.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT (also an index out of range). Do not block. */
MAQ_API maq_status maq_camera_list_get_camera(const maq_camera_list* list, uint32_t index, maq_camera_info* info);
MAQ_API maq_status maq_camera_list_get_mode(const maq_camera_list* list, uint32_t index, uint32_t mode_index,
                                            maq_camera_mode* mode);

#ifdef __cplusplus
}
#endif

#endif /* MAQUETTE_SOURCE_H_ */
