/* DensePose: finds people in a frame and maps each of their pixels to a point of the body surface. */
#ifndef MAQUETTE_DENSEPOSE_H_
#define MAQUETTE_DENSEPOSE_H_

#include "maquette/frame.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct maq_densepose maq_densepose;
typedef struct maq_densepose_result maq_densepose_result;

/* The use that the other defaults are for. */
typedef enum maq_densepose_preset {
  MAQ_DENSEPOSE_PRESET_STREAM = 0, /* frames of a camera or clip: fast */
  MAQ_DENSEPOSE_PRESET_PHOTO = 1 /* single images: everybody is mapped again in a crop of 256 pixels. Parts and outlines
                                    are better; takes two to three times as long. */
} maq_densepose_preset;

/* The labels that each pixel of a person gets. */
typedef enum maq_densepose_detail {
  MAQ_DENSEPOSE_DETAIL_SURFACE = 0, /* part, U and V */
  MAQ_DENSEPOSE_DETAIL_PART = 1     /* only the part: faster; U and V stay 0 */
} maq_densepose_detail;

/* Selects the people who are mapped a second time, in a crop of the frame at full resolution. The crop is rotated
 * upright by the body axis of the first surface. Crops find more of hands, and of people who lean or are far away. Each
 * crop takes about as long as a small frame. */
typedef enum maq_densepose_crops {
  MAQ_DENSEPOSE_CROPS_DEFAULT = 0, /* the preset's: off for streams, all for photos */
  MAQ_DENSEPOSE_CROPS_AUTO = 1,    /* people who are small in the networks' input, or lean by more than 15 degrees */
  MAQ_DENSEPOSE_CROPS_ALL = 2,
  MAQ_DENSEPOSE_CROPS_OFF = 3
} maq_densepose_crops;

/* Options. 0 is the default in every field; `model` has its own (types.h).
 *
 * Frames with a `sequence` above 0, and all frames with key_frame_interval above 1, are frames of a stream. In a
 * stream, a person who hardly moves is seen through the same pixels in each frame. The surface is averaged over the
 * frames, along the motion of people (`steadiness`). */
typedef struct maq_densepose_config {
  uint32_t struct_size;
  maq_model_options model;     /* default bundle: share/maquette/models/densepose-b-int8, installed with the library */
  maq_densepose_preset preset; /* default MAQ_DENSEPOSE_PRESET_STREAM */
  int32_t long_side_px;        /* images are scaled to this long side, 32 to 2048. 0 (default): automatic. The bundle's
                                  value finds near people. If it shows small people or nobody, larger images are also
                                  searched at 480 pixels. In a stream (frames with a `sequence` above 0), earlier
                                  frames count, too. */
  float score_threshold;       /* minimum score of a person, up to 1; 0 (default): the bundle's value. People who were
                                  in the previous frame of a stream stay down to 0.7 of it. */
  int32_t max_people;          /* 1 to 255, best scores first; 0 (default): the bundle's value */
  int32_t max_proposals;       /* boxes that reach the box head, 1 to 1000; 0 (default): the bundle's value. Fewer boxes
                                  are faster and may miss people in a crowd. */
  int32_t key_frame_interval;  /* 0 (default) and 1: every frame is a key frame, in which people are detected. N, up to
                                  1000: every N-th frame of a stream is one. In between, boxes are propagated and no new
                                  people are found; frames without people cost nothing. A frame of another size or of
                                  another roll is a key frame. If each person has a crop (`person_crops`), only the
                                  crops are computed in between. */
  int32_t min_person_height_px;     /* people less tall than this in the frame may be missed, up to 100000; larger is
                                       faster; 0 (default): no limit */
  maq_densepose_detail detail;      /* default MAQ_DENSEPOSE_DETAIL_SURFACE */
  maq_densepose_crops person_crops; /* default MAQ_DENSEPOSE_CROPS_DEFAULT */
  int32_t person_crop_px;           /* side of a crop, 64 to 512; 0 (default): 192, of photos 256. Smaller is faster. */
  uint32_t result_pool_size;        /* results the app may hold at once, 1 to 64; 0 (default): 4 */
  int32_t has_keypoints;            /* 1: keypoints of each person are found (maq_densepose_result_get_keypoints), for
                                       about a millisecond a person; 0 (default): they are not */
  float steadiness;                 /* in a stream: how much the frames before count for parts, U and V, up to 0.95;
                                       0 (default): 0.9; -1: not at all. Larger values flicker less. */
} maq_densepose_config;

typedef struct maq_densepose_person {
  uint32_t struct_size;
  float score;     /* 0 to 1 */
  float box_px[4]; /* in pixels of the frame: left, top, right, bottom; right and bottom are exclusive */
  int64_t id;      /* 1 or more. In a stream, a person keeps the id while seen and for a second after; new people get
                      new ids. A frame with `sequence` 0 begins a stream. */
} maq_densepose_person;

/* Keypoints of a person: MediaPipe Pose's 33, in its order. "Left" is the person's left. */
typedef enum maq_densepose_keypoint {
  MAQ_DENSEPOSE_KEYPOINT_NOSE = 0,
  MAQ_DENSEPOSE_KEYPOINT_LEFT_EYE_INNER = 1,
  MAQ_DENSEPOSE_KEYPOINT_LEFT_EYE = 2,
  MAQ_DENSEPOSE_KEYPOINT_LEFT_EYE_OUTER = 3,
  MAQ_DENSEPOSE_KEYPOINT_RIGHT_EYE_INNER = 4,
  MAQ_DENSEPOSE_KEYPOINT_RIGHT_EYE = 5,
  MAQ_DENSEPOSE_KEYPOINT_RIGHT_EYE_OUTER = 6,
  MAQ_DENSEPOSE_KEYPOINT_LEFT_EAR = 7,
  MAQ_DENSEPOSE_KEYPOINT_RIGHT_EAR = 8,
  MAQ_DENSEPOSE_KEYPOINT_MOUTH_LEFT = 9,
  MAQ_DENSEPOSE_KEYPOINT_MOUTH_RIGHT = 10,
  MAQ_DENSEPOSE_KEYPOINT_LEFT_SHOULDER = 11,
  MAQ_DENSEPOSE_KEYPOINT_RIGHT_SHOULDER = 12,
  MAQ_DENSEPOSE_KEYPOINT_LEFT_ELBOW = 13,
  MAQ_DENSEPOSE_KEYPOINT_RIGHT_ELBOW = 14,
  MAQ_DENSEPOSE_KEYPOINT_LEFT_WRIST = 15,
  MAQ_DENSEPOSE_KEYPOINT_RIGHT_WRIST = 16,
  MAQ_DENSEPOSE_KEYPOINT_LEFT_PINKY = 17, /* knuckles of the hand */
  MAQ_DENSEPOSE_KEYPOINT_RIGHT_PINKY = 18,
  MAQ_DENSEPOSE_KEYPOINT_LEFT_INDEX = 19,
  MAQ_DENSEPOSE_KEYPOINT_RIGHT_INDEX = 20,
  MAQ_DENSEPOSE_KEYPOINT_LEFT_THUMB = 21,
  MAQ_DENSEPOSE_KEYPOINT_RIGHT_THUMB = 22,
  MAQ_DENSEPOSE_KEYPOINT_LEFT_HIP = 23,
  MAQ_DENSEPOSE_KEYPOINT_RIGHT_HIP = 24,
  MAQ_DENSEPOSE_KEYPOINT_LEFT_KNEE = 25,
  MAQ_DENSEPOSE_KEYPOINT_RIGHT_KNEE = 26,
  MAQ_DENSEPOSE_KEYPOINT_LEFT_ANKLE = 27,
  MAQ_DENSEPOSE_KEYPOINT_RIGHT_ANKLE = 28,
  MAQ_DENSEPOSE_KEYPOINT_LEFT_HEEL = 29,
  MAQ_DENSEPOSE_KEYPOINT_RIGHT_HEEL = 30,
  MAQ_DENSEPOSE_KEYPOINT_LEFT_FOOT_INDEX = 31, /* the big toe */
  MAQ_DENSEPOSE_KEYPOINT_RIGHT_FOOT_INDEX = 32
} maq_densepose_keypoint;

#define MAQ_DENSEPOSE_KEYPOINT_COUNT 33

/* Returns the name of a keypoint ("left_wrist"), or "unknown" for numbers outside 0 to 32. The text is static.
 * Any thread. Does not fail or block. */
MAQ_API const char* maq_densepose_get_keypoint_name(int32_t keypoint);

/* The planes of a result: one byte a pixel of the frame. */
typedef enum maq_densepose_plane {
  MAQ_DENSEPOSE_PLANE_PART = 1,  /* I: body part 1 to 24, 0 for background (the DensePose numbering) */
  MAQ_DENSEPOSE_PLANE_U = 2,     /* U * 255, rounded; 0 on background */
  MAQ_DENSEPOSE_PLANE_V = 3,     /* V * 255, rounded; 0 on background */
  MAQ_DENSEPOSE_PLANE_PERSON = 4 /* index of the person in the result, plus 1; 0 for background */
} maq_densepose_plane;

/* Returns the name of a body part ("left upper arm, outside"). Returns "background" for 0, and "unknown part" for
 * numbers outside 0 to 24. The text is static. Any thread. Does not fail or block. */
MAQ_API const char* maq_densepose_get_part_name(int32_t part);

/* Writes the colour of a part in the SDK's images: red, green, blue. Writes black for numbers outside 1 to 24.
 * Any thread. Does not fail (NULL is fine) or block. */
MAQ_API void maq_densepose_get_part_colour(int32_t part, uint8_t rgb[3]);

/* Wall-clock times of the stages of a run in milliseconds, and counts. */
typedef struct maq_densepose_stats {
  uint32_t struct_size;
  float preprocess_ms; /* resize and normalise */
  float trunk_ms;      /* the trunk (backbone and FPN): features of the whole image */
  float proposals_ms;  /* region proposal network, top-k, NMS */
  float box_head_ms;   /* RoIAlign, box network, NMS */
  float dense_head_ms; /* RoIAlign, dense network */
  float crops_ms;      /* crops of people: trunk and dense head over them */
  float decode_ms;     /* logits to planes, with U and V */
  float total_ms;
  int32_t network_width_px; /* the resized image, without padding */
  int32_t network_height_px;
  int32_t proposal_count;      /* boxes that reached the box head */
  int32_t person_count;        /* people in the result */
  int32_t crop_count;          /* computed crops of people (maq_densepose_crops) */
  int32_t dropped_box_count;   /* boxes with NaN, or with no area inside the frame */
  int64_t body_pixel_count;    /* pixels that belong to a person */
  int64_t clamped_pixel_count; /* body pixels where the network's U or V was outside 0 to 1 */
  int32_t is_key_frame;        /* 1: people were detected; 0: boxes of the previous frame were propagated */
  maq_provider provider;       /* provider in use for the trunk */
  int32_t threads;             /* threads of the networks; fewer if the system starts no more (see the log) */
  int32_t is_threads_measured; /* 1: MAQ_THREADS_MEASURED chose the number of threads */
  float keypoints_ms;          /* network of keypoints, and their places */
} maq_densepose_stats;

/* Fills `config` with the defaults and sets struct_size. `struct_size` is sizeof(maq_densepose_config) of the caller.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_densepose_config_init(maq_densepose_config* config, uint32_t struct_size);

/* Loads a model bundle. Checks the size and SHA-256 of every file, and the inputs and outputs of the networks, against
 * the manifest. `config` may be NULL for the defaults. Free `*densepose` with maq_densepose_destroy.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT, MAQ_ERROR_NOT_FOUND, MAQ_ERROR_BAD_BUNDLE,
 * MAQ_ERROR_RUNTIME_LIBRARY. Blocks while files are read, and while networks are prepared and measured. */
MAQ_API maq_status maq_densepose_create(maq_context* context, const maq_densepose_config* config,
                                        maq_densepose** densepose);

/* Frees the networks (NULL is fine). Results that are still held stay valid until they are released.
 * Once for each handle, from any thread. May block briefly. */
MAQ_API void maq_densepose_destroy(maq_densepose* densepose);

/* Finds the people in a frame and maps their pixels to the body surface. The frame may have any pixel format except
 * depth. It is not kept. `*result` comes from a pool of result_pool_size: give it back with
 * maq_densepose_result_release. If no people are found, the dense head does not run and the planes are zero. After an
 * error the next frame is a key frame.
 * One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT, MAQ_ERROR_UNSUPPORTED (a depth image), MAQ_ERROR_POOL_EMPTY,
 * MAQ_ERROR_INFERENCE, MAQ_CANCELLED. Blocks while the networks run. */
MAQ_API maq_status maq_densepose_run(maq_densepose* densepose, const maq_frame* frame, maq_densepose_result** result);

/* Cancels the running maq_densepose_run, or else the next one. It returns MAQ_CANCELLED after the current layer of its
 * network. Later runs are not affected; the next frame is a key frame.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_densepose_cancel(maq_densepose* densepose);

/* Sets the roll of the camera for the next frames, which show the world rotated clockwise by `roll_rad`: -7 to 7
 * radians, 0 at first. At 0.5, the head of a standing person is to the upper right of the feet. The networks are
 * trained on upright people. The library therefore rotates each frame upright for them, in steps of 15 degrees. Results
 * stay in pixels of the frame. The input around a rotated frame is larger: halfway between upright and sideways it
 * takes twice as long. A change of the step makes the next frame a key frame.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_densepose_set_roll(maq_densepose* densepose, float roll_rad);

/* Starts a new stream: the next frame is a key frame. Needed only with key_frame_interval above 1.
 * One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_densepose_reset(maq_densepose* densepose);

/* Gives the result back (NULL is fine). Pointers into it are invalid afterwards.
 * Once for each result, from any thread. Does not block. */
MAQ_API void maq_densepose_result_release(maq_densepose_result* result);

/* Gets the size of the planes, which is the size of the frame. Either pointer may be NULL.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_densepose_result_get_size(const maq_densepose_result* result, int32_t* width_px,
                                                 int32_t* height_px);

/* Returns the number of people found; 0 for NULL. Any thread. Does not fail or block. */
MAQ_API uint32_t maq_densepose_result_get_person_count(const maq_densepose_result* result);

/* Gets the person at `index`, best score first. The caller sets person->struct_size. Each person has at least one
 * pixel: boxes without body pixels are dropped. Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT (index out of range).
 * Does not block. */
MAQ_API maq_status maq_densepose_result_get_person(const maq_densepose_result* result, uint32_t index,
                                                   maq_densepose_person* person);

/* Gets the box of a person's head (the pixels of parts 23 and 24), for example for maq_head_photo. The box is in pixels
 * of the frame: left, top, right, bottom; right and bottom are exclusive.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT (index out of range), MAQ_ERROR_NOT_FOUND (no pixel shows the head).
 * Does not block. */
MAQ_API maq_status maq_densepose_result_get_head_box(const maq_densepose_result* result, uint32_t index,
                                                     float box_px[4]);

/* Gets the keypoints of a person, 99 numbers: x, y and confidence of each keypoint, in the order of
 * maq_densepose_keypoint. x and y are in pixels of the frame. The confidence, 0 to 1, is the probability that the
 * keypoint lies within about 4 % of the person's box of there. It is low for keypoints that the frame does not show. Of
 * the keypoints with 0.15 or more, most are right; below, the place means little.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT (index out of range), MAQ_ERROR_NOT_FOUND (has_keypoints was 0).
 * Does not block. */
MAQ_API maq_status maq_densepose_result_get_keypoints(const maq_densepose_result* result, uint32_t index,
                                                      float keypoints[99]);

/* Gets a plane: height_px rows of `*stride_bytes` bytes (maq_densepose_result_get_size). The pixels are inside the
 * result and valid until it is released. Neither pointer may be NULL. Where people overlap, a pixel belongs to the
 * likelier person.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_densepose_result_get_plane(const maq_densepose_result* result, maq_densepose_plane plane,
                                                  const uint8_t** pixels, size_t* stride_bytes);

/* Gets times and counts of the run that made the result. The caller sets stats->struct_size.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_densepose_result_get_stats(const maq_densepose_result* result, maq_densepose_stats* stats);

/* The colours of body parts in drawings. Values never change meaning; new ones are added at the end. */
typedef enum maq_densepose_colours {
  MAQ_DENSEPOSE_COLOURS_DEFAULT = 0,     /* the SDK's colours (maq_densepose_get_part_colour) */
  MAQ_DENSEPOSE_COLOURS_DETECTRON2 = 1,  /* detectron2's "dp_segm": Parula. ControlNet models expect them opaque on
                                            black. */
  MAQ_DENSEPOSE_COLOURS_MAGICANIMATE = 2 /* the same with Viridis. MagicAnimate expects them opaque on (68, 1, 84). */
} maq_densepose_colours;

/* For maq_densepose_drawing.opacity: the colours are not drawn. */
#define MAQ_DENSEPOSE_INVISIBLE (-1)

/* Options of maq_densepose_result_draw. */
typedef struct maq_densepose_drawing {
  uint32_t struct_size;
  int32_t x_px; /* top left corner of the drawn part of the frame; 0 (default): the frame's corner */
  int32_t y_px;
  int32_t width_px;              /* 0 (default): up to the frame's right edge */
  int32_t height_px;             /* 0 (default): down to the frame's lower edge */
  int32_t opacity;               /* opacity of the colours, 1 to 255 (they cover the frame); 0 (default): 180; or
                                      MAQ_DENSEPOSE_INVISIBLE */
  int32_t is_mirrored;           /* 1: left and right are exchanged, as in a mirror; default 0 */
  maq_densepose_colours colours; /* default MAQ_DENSEPOSE_COLOURS_DEFAULT */
} maq_densepose_drawing;

/* Fills `drawing` with the defaults and sets struct_size. `struct_size` is sizeof(maq_densepose_drawing) of the caller.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_densepose_drawing_init(maq_densepose_drawing* drawing, uint32_t struct_size);

/* Draws the people over their frame into memory of the app, for a preview or a window. Each of their pixels is blended
 * with the colour of its part (drawing->colours). `frame` is the frame of the result. If it is NULL, the
 * colours are drawn on transparent ground, multiplied by their opacity. `rgba` gets height_px rows of `stride_bytes`
 * bytes (0: rows without padding), 4 bytes a pixel; it has `size_bytes` bytes. `drawing` may be NULL for the defaults.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT (too little memory, a part that is not inside the frame, a frame of
 * another size), MAQ_ERROR_UNSUPPORTED (a depth image). Does not block. */
MAQ_API maq_status maq_densepose_result_draw(const maq_densepose_result* result, const maq_frame* frame,
                                             const maq_densepose_drawing* drawing, uint8_t* rgba, size_t stride_bytes,
                                             size_t size_bytes);

/* Writes three files in the DensePose convention (docs/reference/formats.md):
 *   <path>_IUV.png   channels I, U * 255, V * 255 in the file's order B, G, R
 *   <path>_INDS.png  MAQ_DENSEPOSE_PLANE_PERSON
 *   <path>.json      size, boxes, scores
 * The folder of `path` must exist. Existing files are replaced atomically, after all three have been written.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT (`path` is empty or ends with '/'), MAQ_ERROR_UNWRITABLE.
 * Blocks while they are written. */
MAQ_API maq_status maq_densepose_result_save(const maq_densepose_result* result, const char* path);

/* The points of the template body in its rest pose, for each part, U and V. In metres: x to the body's left, y to its
 * back, z up. */
typedef struct maq_densepose_surface {
  uint32_t struct_size;
  int32_t nodes;         /* number of nodes along U, and along V; at least 2 */
  const float* points_m; /* [24][nodes][nodes][3]: part - 1, U * (nodes - 1), V * (nodes - 1); x, y, z. Interpolate
                            between nodes bilinearly. x, y and z are NaN outside the chart of the part. */
} maq_densepose_surface;

/* Gets the surface that the bundle's labels refer to. The caller sets surface->struct_size. The points belong to
 * `densepose` and live as long as it does.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT, MAQ_ERROR_UNSUPPORTED (the bundle has no surface),
 * MAQ_ERROR_BAD_BUNDLE (the surface is damaged). Blocks briefly the first time, while the surface is decoded. */
MAQ_API maq_status maq_densepose_get_surface(maq_densepose* densepose, maq_densepose_surface* surface);

#ifdef __cplusplus
}
#endif

#endif /* MAQUETTE_DENSEPOSE_H_ */
