/* Bodies: pose, shape and mesh of the people in a dense pose image.
 *
 *   maq_body_create(context, NULL, &body);
 *   maq_body_input_init(&input, sizeof input);    planes of a maq_densepose_result
 *   maq_body_run(body, &input, &result);
 *   maq_body_result_get_person(result, 0, &person);
 *   maq_body_result_release(result);
 *
 * A maq_body_clip collects the results of a clip, and writes them as glTF or BVH. This part of the API may still
 * change. */
#ifndef MAQUETTE_BODY_H_
#define MAQUETTE_BODY_H_

#include "maquette/frame.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct maq_body maq_body;
typedef struct maq_body_result maq_body_result;
typedef struct maq_body_clip maq_body_clip;

typedef struct maq_body_config {
  uint32_t struct_size;
  maq_model_options model;   /* default bundle: share/maquette/models/body. It has no network: threads and provider have
                                no effect */
  uint32_t result_pool_size; /* results the app may hold at once, 1 to 64; 0 (default): 4 */
} maq_body_config;

/* A dense pose image. All pointers are read during maq_body_run only. */
typedef struct maq_body_input {
  uint32_t struct_size;
  int32_t width_px; /* size of the planes, 1 to 16384 */
  int32_t height_px;
  const uint8_t* part;    /* MAQ_DENSEPOSE_PLANE_PART: body part 1 to 24, 0 for background */
  const uint8_t* u;       /* U * 255 */
  const uint8_t* v;       /* V * 255 */
  const uint8_t* person;  /* index of the person plus 1; NULL (default): all parts are of one person */
  size_t stride_bytes;    /* from one row to the next, of each plane; 0 (default): width_px */
  uint32_t person_count;  /* 0 to 255 */
  const int64_t* ids;     /* person_count ids of a stream, from 1; 0: unknown. NULL (default): all unknown */
  const float* keypoints; /* person_count times 99 numbers: x, y in pixels and confidence of each keypoint, as of
                             maq_densepose_result_get_keypoints; NULL (default): none */
  const maq_intrinsics* intrinsics; /* camera of the image; distortion is ignored. NULL (default): unknown, and people
                                       are seen in weak perspective: all of a person at one depth */
  int64_t timestamp_ns;             /* of the frame */
  const float* heights_m; /* person_count heights of people in metres, 1.3 to 2.3; 0: unknown. NULL (default): all
                             unknown. One camera does not show how large a person is: mesh, pelvis_m and sizes are those
                             of a person of average height unless the height is given */
} maq_body_input;

/* The outcome for one person. Values never change meaning; new ones are added at the end. */
typedef enum maq_body_fit {
  MAQ_BODY_FIT_FITTED = 0,
  MAQ_BODY_FIT_TOO_FEW_PIXELS = 1, /* the image shows too little of the person */
  MAQ_BODY_FIT_UNRELIABLE = 2      /* fewer than 40 % of the person's pixels agree with the best pose */
} maq_body_fit;

/* Angles of joints in degrees. Elbow and knee: 0 when straight. Hip and shoulder: direction of the limb in the sagittal
 * plane of pelvis or chest. It is 0 when the limb hangs down, 90 to the front, negative to the back. It means little
 * for a limb that points sideways. */
typedef enum maq_body_angle {
  MAQ_BODY_ANGLE_LEFT_ELBOW = 0,
  MAQ_BODY_ANGLE_RIGHT_ELBOW = 1,
  MAQ_BODY_ANGLE_LEFT_KNEE = 2,
  MAQ_BODY_ANGLE_RIGHT_KNEE = 3,
  MAQ_BODY_ANGLE_LEFT_HIP = 4,
  MAQ_BODY_ANGLE_RIGHT_HIP = 5,
  MAQ_BODY_ANGLE_LEFT_SHOULDER = 6,
  MAQ_BODY_ANGLE_RIGHT_SHOULDER = 7
} maq_body_angle;

#define MAQ_BODY_ANGLE_COUNT 8
#define MAQ_BODY_KEYPOINT_COUNT 33

/* The mesh and the skeleton that all bodies share. */
typedef struct maq_body_mesh {
  uint32_t struct_size;
  uint32_t vertex_count;
  uint32_t triangle_count;
  const uint32_t* triangles; /* three vertices each, counter-clockwise seen from outside */
  uint32_t joint_count;
  const char* const* joint_names; /* "pelvis", "upper_arm.L", ... */
  const int32_t* joint_parents;   /* -1 of the first joint; parents come before their children */
  uint32_t shape_count;           /* coefficients of a shape */
} maq_body_mesh;

/* The body of one person. Positions are in metres, in axes of the camera (x right, y down, z forward), from the pelvis.
 * The pointers are inside the result; they are NULL unless the person was fitted. */
typedef struct maq_body_person {
  uint32_t struct_size;
  maq_body_fit fit;        /* if not MAQ_BODY_FIT_FITTED, all below except `id` is 0 */
  int64_t id;              /* of the input; 0: unknown */
  float inlier_fraction;   /* of the sampled pixels: those that agree with the pose, 0 to 1 */
  float error_px;          /* root mean square distance of these pixels from their points of the body */
  int32_t iteration_count; /* of the fit */
  uint32_t seen_joints;    /* bit j: the image shows the bones of joint j. Other joints follow the prior of poses. */
  int32_t is_metric;       /* 1: the intrinsics are known, and pelvis_m has its place */
  float pelvis_m[3];       /* place of the pelvis in the camera; 0 without intrinsics */
  float pelvis_px[2];      /* pixel of the pelvis */
  float scale_px_per_m;    /* at the pelvis */
  float orientation[9];    /* rotation of the pelvis, row by row: body axes (x left, y back, z up) to camera axes */
  float angles_deg[MAQ_BODY_ANGLE_COUNT]; /* in the order of maq_body_angle */
  const float* shape;                     /* [shape_count]: standard deviations, -3 to 3 */
  const float* joint_rotations; /* [joint_count][3]: rotation vector relative to the parent in body axes, radians; 0 for
                                   the pelvis, whose rotation is `orientation` */
  const float* joints_m;        /* [joint_count][3] */
  const float* keypoints_m;     /* [33][3], in the order of maq_densepose_keypoint */
  const float* vertices_m;      /* [vertex_count][3] */
} maq_body_person;

/* A size, and the interval that contains the true size of 90 % of people (docs/research/body.md). */
typedef struct maq_body_size {
  float value_m;
  float low_m;
  float high_m;
} maq_body_size;

/* Sizes of the body without clothes, standing upright. Girths are measured around the convex hull of the torso, without
 * the arms. */
typedef struct maq_body_sizes {
  uint32_t struct_size;
  int32_t is_height_known; /* 1: heights_m had the height. 0: all sizes have the wide intervals of an unknown scale;
                              with another height h, multiply them by h / height.value_m */
  maq_body_size height;    /* from the soles to the top of the head; exact where it is known */
  maq_body_size chest;     /* girth between armpits and nipples */
  maq_body_size waist;     /* girth of the narrowest part */
  maq_body_size hip;       /* girth of the widest part of the buttocks */
  maq_body_size inseam;    /* from the crotch to the soles */
} maq_body_sizes;

/* Returns the name of an angle ("left_elbow"), or "unknown" for numbers outside 0 to 7. The text is static.
 * Any thread. Does not fail or block. */
MAQ_API const char* maq_body_get_angle_name(int32_t angle);

/* Fills `config` with the defaults and sets struct_size. `struct_size` is sizeof(maq_body_config) of the caller.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_body_config_init(maq_body_config* config, uint32_t struct_size);

/* Fills `input` with the defaults and sets struct_size. `struct_size` is sizeof(maq_body_input) of the caller.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_body_input_init(maq_body_input* input, uint32_t struct_size);

/* Loads a bundle of the task "body" and checks size and SHA-256 of its file. `config` may be NULL for the defaults. The
 * caller owns `*body`: free it with maq_body_destroy.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT, MAQ_ERROR_NOT_FOUND, MAQ_ERROR_BAD_BUNDLE, MAQ_ERROR_UNSUPPORTED (a
 * bundle of another task). Blocks while the file is read. */
MAQ_API maq_status maq_body_create(maq_context* context, const maq_body_config* config, maq_body** body);

/* Frees the body (NULL is fine). Results and clips stay valid until they are given back.
 * Once for each handle, from any thread. Does not block. */
MAQ_API void maq_body_destroy(maq_body* body);

/* Fits a body to each person of a dense pose image. A person with an id starts from the body in the frame before, if
 * that was at most a second earlier. The shape of such a person settles over the frames. A time that goes back starts a
 * new stream.
 * `*result` comes from a pool of result_pool_size: release it with maq_body_result_release.
 * One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT, MAQ_ERROR_POOL_EMPTY. Blocks while it computes. */
MAQ_API maq_status maq_body_run(maq_body* body, const maq_body_input* input, maq_body_result** result);

/* Starts a new stream: people of earlier frames are forgotten.
 * One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_body_reset(maq_body* body);

/* Gets mesh and skeleton. The caller sets mesh->struct_size. The pointers belong to `body` and live as long as it does.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_body_get_mesh(const maq_body* body, maq_body_mesh* mesh);

/* Returns the result to its pool (NULL is fine). Pointers into it are invalid afterwards.
 * Once for each result, from any thread. Does not block. */
MAQ_API void maq_body_result_release(maq_body_result* result);

/* Returns the number of people, which is that of the input; 0 for NULL. Any thread. Does not fail or block. */
MAQ_API uint32_t maq_body_result_get_person_count(const maq_body_result* result);

/* Gets the person at `index`, in the order of the input. The caller sets person->struct_size.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT (index out of range). Does not block. */
MAQ_API maq_status maq_body_result_get_person(const maq_body_result* result, uint32_t index, maq_body_person* person);

/* Gets the sizes of the person at `index`. The caller sets sizes->struct_size. Intervals are wider where the image
 * shows less of a person, and for people of the average population of the body's bundle. Any thread. Errors:
 * MAQ_ERROR_INVALID_ARGUMENT (index out of range), MAQ_ERROR_NOT_FOUND (the person was not fitted). Does not block. */
MAQ_API maq_status maq_body_result_get_sizes(const maq_body_result* result, uint32_t index, maq_body_sizes* sizes);

/* Creates an empty clip of bodies. The caller owns `*clip`: free it with maq_body_clip_destroy.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_body_clip_create(maq_body* body, maq_body_clip** clip);

/* Frees the clip (NULL is fine). Once for each handle, from any thread. Does not block. */
MAQ_API void maq_body_clip_destroy(maq_body_clip* clip);

/* Adds the fitted people of a result. The result must come from the maq_body that made the clip. A person without an id
 * counts as a new one. A person whose time is not later than before is left out.
 * One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT, MAQ_ERROR_UNSUPPORTED (more than 1000 people). Does not block. */
MAQ_API maq_status maq_body_clip_add_result(maq_body_clip* clip, const maq_body_result* result);

/* Returns the number of people in the clip; 0 for NULL. One at a time. Does not fail or block. */
MAQ_API uint32_t maq_body_clip_get_person_count(const maq_body_clip* clip);

/* Writes all people to one .glb file: a mesh with a skin for each person, and an animation if a person has several
 * frames (docs/reference/formats.md). Without intrinsics a focal length of 1.2 times the longer side of the image is
 * assumed. The file appears atomically.
 * One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT (another extension), MAQ_ERROR_NOT_FOUND (the clip has no people),
 * MAQ_ERROR_UNWRITABLE. Blocks while it writes. */
MAQ_API maq_status maq_body_clip_save(maq_body_clip* clip, const char* path);

/* Writes one person to a .glb or a .bvh file. The person with the most frames has the index 0.
 * One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT (another extension, index out of range), MAQ_ERROR_UNWRITABLE.
 * Blocks while it writes. */
MAQ_API maq_status maq_body_clip_save_person(maq_body_clip* clip, uint32_t index, const char* path);

#ifdef __cplusplus
}
#endif

#endif /* MAQUETTE_BODY_H_ */
