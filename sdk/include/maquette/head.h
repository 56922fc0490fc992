/* Heads: a 3D head, closed, coloured and in metres, from one photo of a person or several.
 *
 *   maq_head_builder_create(context, NULL, &builder);
 *   maq_head_builder_add_photo(builder, frame, NULL);
 *   maq_head_builder_fit(builder, 3.0, NULL, NULL, &head);
 *   maq_head_export(head, "head.glb", NULL);
 *   maq_head_save(head, "head.maqh");
 *
 * A face is biometric data: ask the person, and keep heads as you would keep passwords. Nothing leaves the device. A
 * builder keeps the part of each photo around the head until maq_head_builder_clear or its end; a head and its file
 * hold no photo, unless the builder's config asks for a texture, which has the face's pixels.
 */
#ifndef MAQUETTE_HEAD_H_
#define MAQUETTE_HEAD_H_

#include "maquette/frame.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Points of a head are in metres: x to the person's left, y to the back of the head, z up, the origin in its middle. */

typedef struct maq_head_builder maq_head_builder;
typedef struct maq_head maq_head;

typedef struct maq_head_config {
  uint32_t struct_size;
  int32_t threads;         /* of the network and the fit, 1 to 64; 0 (default): the machine's large cores, at most 4;
                              MAQ_THREADS_MEASURED: as many of these as pay for the network, measured */
  const char* bundle_path; /* folder with manifest.json; NULL (default): bundle_files, or without them the bundle
                                 installed with the library (share/maquette/models/heads-int8). Copied. */
  const maq_memory_file* bundle_files; /* the bundle's files in memory, instead of bundle_path; default NULL. Copied. */
  uint32_t bundle_file_count;          /* default 0 */
  int32_t allow_spinning; /* 1 (default): idle threads of the network spin for a while; 0: they sleep, which saves
                                   energy and costs some speed */
  maq_provider provider;  /* for the network; default MAQ_PROVIDER_CPU. One that cannot be had, or that takes less than
                             half of the network, is replaced by the CPU: the log says why. */
  uint32_t texture_px; /* of heads, pixels a side, 256 to 2048: the photos' pixels where they see the surface well, the
                          network's colours elsewhere. 0 (default): heads have none, and hold no part of a photo. With
                          1024 a fit takes 140 MB of memory more, and a second or two. */
  int32_t texture_mirrored; /* 1: where no photo sees one side of the head, it looks as the other; 0 (default): as the
                               network has it */
} maq_head_config;

/* What the app knows of a photo. */
typedef struct maq_head_photo {
  uint32_t struct_size;
  float box_px[4]; /* of the head with its hair: left, top, right, bottom, the latter two exclusive; it may reach beyond
                      the photo. All 0 (default): the head is looked for, which takes longer, and finds it where it is
                      alone in the photo and not small: give boxes where there are several people. */
  float roll_rad;  /* how far the head is turned in the photo's plane, clockwise from upright, -7 to 7; default 0. It
                      need be right to some 30 degrees. */
  float focal_px;  /* of the camera, in pixels of this photo, 0.001 to 1e9; 0 (default): not known, and found along */
} maq_head_photo;

/* What was found of a photo. */
typedef struct maq_head_photo_info {
  uint32_t struct_size;
  float box_px[4];     /* in which the head was seen: given, or found */
  float head_fraction; /* of that box's surroundings, 0 to 1: how much the network sees as head */
  /* The rest is of the latest maq_head_builder_fit, 0 before. */
  int32_t is_used; /* 1: the head was fitted to it. 0: no head, or another than in the other photos, was in it. */
  float focal_px;  /* of the camera, given or estimated; 0 where it was not used */
  float rms_px;    /* root mean square distance of points of the head from where the network saw them; likewise */
} maq_head_photo_info;

/* Times of stages, in wall-clock milliseconds, and counts, of the photos so far and of the latest fit. */
typedef struct maq_head_stats {
  uint32_t struct_size;
  uint32_t photo_count;
  uint32_t used_photo_count; /* to which the head was fitted */
  float encode_ms;           /* the network, in maq_head_builder_add_photo, over all photos */
  float pose_ms;             /* cameras and a first shape, from what the network saw */
  float fit_ms;              /* the head fitted to the pixels, within the time given */
  float total_ms;            /* of maq_head_builder_fit */
  int32_t step_count;        /* of the fit to the pixels */
  maq_provider provider;     /* in use for the network */
  int32_t threads;
} maq_head_stats;

/* Where the size of a head is from. */
typedef enum maq_head_scale {
  MAQ_HEAD_SCALE_PRIOR = 0, /* heads are that large on average: photos alone do not tell */
  MAQ_HEAD_SCALE_GIVEN = 1, /* a distance that was known */
  MAQ_HEAD_SCALE_DEPTH = 2  /* a depth camera */
} maq_head_scale;

typedef struct maq_head_info {
  uint32_t struct_size;
  uint32_t photo_count;    /* that it was fitted to */
  uint32_t landmark_count; /* places with a name */
  maq_head_scale scale;
  float scale_sigma;   /* standard deviation of its size, as a fraction of it: 0.04 is 4 %; 0: not known */
  uint32_t texture_px; /* pixels a side; 0: it has no texture */
} maq_head_info;

/* How fine a mesh is. */
typedef struct maq_head_mesh_options {
  uint32_t struct_size;
  uint32_t triangle_count; /* about as many, 100 or more: of the full mesh as many edges are collapsed as that takes,
                              those first that move the surface least. 0 (default): 60,000, or with a cell_m all;
                              MAQ_HEAD_ALL_TRIANGLES: all. */
  double cell_m; /* distance of neighbouring vertices of the full mesh, about, 0.0005 to 0.02; 0 (default): 0.0016 */
} maq_head_mesh_options;

#define MAQ_HEAD_ALL_TRIANGLES 0xFFFFFFFFu

/* A mesh: closed, without holes, cut off below the chin. Where there is a texture, vertices around the cut are there
 * twice, once for the cap. */
typedef struct maq_head_mesh {
  uint32_t struct_size;
  uint32_t vertex_count;
  uint32_t triangle_count;
  const float* positions_m;       /* [vertex_count][3] */
  const float* normals;           /* [vertex_count][3], outwards, of length 1 */
  const uint8_t* colours_rgb;     /* [vertex_count][3], sRGB */
  const float* template_points_m; /* [vertex_count][3]: where the point lies on the template head, which is the same
                                     place (the tip of the nose, say) on every head */
  const uint32_t* triangles;      /* [triangle_count][3], counter-clockwise seen from outside */
  float
      simplification_error_m; /* the largest distance of a vertex of the full mesh from this one; 0 where it is full */
  /* Of a head with a texture, else NULL and 0. */
  const float* texture_coordinates; /* [vertex_count][2]: u to the right, v down, 0 to 1 */
  const uint8_t* texture_jpeg;      /* a JPEG file, square: a disc, its middle the crown, the face in its lower half */
  uint32_t texture_bytes;           /* of it */
} maq_head_mesh;

/* A place of the head that has a name. */
typedef struct maq_head_landmark {
  uint32_t struct_size;
  float sigma_m; /* standard deviation of each coordinate that the shape model leaves; that of the size comes on top */
  double point_m[3];
} maq_head_landmark;

/* Receives the progress of maq_head_builder_fit on its thread: `done` is the fraction, 0 to 1. Return 0 to cancel,
 * anything else to go on. It must not call the builder, nor throw. */
typedef int32_t (*maq_head_progress_callback)(void* user_data, double done);

/* Fills `config` with the defaults and sets struct_size. `struct_size` is sizeof(maq_head_config) of the caller.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_head_config_init(maq_head_config* config, uint32_t struct_size);

/* Fills `photo` with the defaults and sets struct_size. `struct_size` is sizeof(maq_head_photo) of the caller.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_head_photo_init(maq_head_photo* photo, uint32_t struct_size);

/* Loads a model bundle of the task "heads", and checks its files' sizes and SHA-256. `config` may be NULL for the
 * defaults. `*builder` is the caller's, to be given to maq_head_builder_destroy.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT, MAQ_ERROR_NOT_FOUND, MAQ_ERROR_BAD_BUNDLE, MAQ_ERROR_UNSUPPORTED (a
 * bundle of another task), MAQ_ERROR_RUNTIME_LIBRARY. Blocks while files are read and the network is prepared. */
MAQ_API maq_status maq_head_builder_create(maq_context* context, const maq_head_config* config,
                                           maq_head_builder** builder);

/* Frees the builder and what it has of photos (NULL is fine). Heads stay.
 * Once for each builder, from any thread. Does not block. */
MAQ_API void maq_head_builder_destroy(maq_head_builder* builder);

/* Looks at a photo of the head: a colour or grey picture of any format, whose lens is not distorted. Several photos
 * must be of one person; each may have its own camera. `photo` may be NULL for the defaults; the photo's index is how
 * many were there before. The frame is not kept, the part around the head is. On failure the builder stays as it was.
 * One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT (a box that is empty, not finite or outside of the photo, a focal
 * length that is not positive, more than 64 photos), MAQ_ERROR_NOT_FOUND (there is no head), MAQ_ERROR_UNSUPPORTED (a
 * depth image), MAQ_ERROR_BAD_BUNDLE (the graph is not what the manifest says), MAQ_ERROR_INFERENCE, MAQ_CANCELLED.
 * Blocks while the network runs, once, or with a box to be found up to three times. */
MAQ_API maq_status maq_head_builder_add_photo(maq_head_builder* builder, const maq_frame* frame,
                                              const maq_head_photo* photo);

/* Forgets the photos, for a head of another person.
 * One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_head_builder_clear(maq_head_builder* builder);

/* Fits one head to the photos so far. First its cameras and a shape from what the network saw, in milliseconds; that is
 * the head where `seconds` is 0. Then shape and colours to the pixels, for up to `seconds` (0 to 3600), or until that
 * gains no more; some 3 are enough on a laptop. What a photo does not show is as heads are that look alike otherwise.
 * A photo that shows no head, or another's, is left out as long as one is used (maq_head_photo_info). `progress` may be
 * NULL; `user_data` is passed to it. More photos may be added afterwards and all be fitted again. `*head` is the
 * caller's, to be given to maq_head_destroy. The result is the same for the same photos, steps, threads and processor.
 * One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT (no photos), MAQ_ERROR_NOT_FOUND (no photo shows a head),
 * MAQ_CANCELLED. Blocks until it is done. */
MAQ_API maq_status maq_head_builder_fit(maq_head_builder* builder, double seconds, maq_head_progress_callback progress,
                                        void* user_data, maq_head** head);

/* Cancels the maq_head_builder_add_photo or maq_head_builder_fit that runs, or else the next: it returns MAQ_CANCELLED.
 * Later ones run as usual. Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_head_builder_cancel(maq_head_builder* builder);

/* Gets times and counts. The caller sets stats->struct_size.
 * One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_head_builder_get_stats(const maq_head_builder* builder, maq_head_stats* stats);

/* Gets what was found of the photo at `index`. The caller sets info->struct_size.
 * One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT (index out of range). Does not block. */
MAQ_API maq_status maq_head_builder_get_photo(const maq_head_builder* builder, uint32_t index,
                                              maq_head_photo_info* info);

/* Reads a file that maq_head_save wrote. It needs no bundle. `*head` is the caller's, to be given to maq_head_destroy.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT, MAQ_ERROR_NOT_FOUND, MAQ_ERROR_UNREADABLE (not a head, truncated,
 * damaged), MAQ_ERROR_UNSUPPORTED (another version). Blocks while the file is read. */
MAQ_API maq_status maq_head_open(maq_context* context, const char* path, maq_head** head);

/* Writes the head to a file, some 60 KB and its texture (docs/formats.md), which appears atomically and replaces an
 * existing one. Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT, MAQ_ERROR_UNWRITABLE. Blocks while it is written. */
MAQ_API maq_status maq_head_save(const maq_head* head, const char* path);

/* Frees the head (NULL is fine); pointers of its meshes are invalid afterwards.
 * Once for each head, from any thread. Does not block. */
MAQ_API void maq_head_destroy(maq_head* head);

/* Gets counts and scale. The caller sets info->struct_size.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_head_get_info(const maq_head* head, maq_head_info* info);

/* Returns the name of the landmark at `index`, in the order of the model; NULL for others. Those of the SDK's model:
 * nose_tip, nose_bridge, chin, crown, pupil_left, pupil_right, temple_left, temple_right, ear_top_left, ear_top_right,
 * ear_bottom_left, ear_bottom_right; left is the person's. The text is the head's. Any thread. Does not fail or block.
 */
MAQ_API const char* maq_head_get_landmark_name(const maq_head* head, uint32_t index);

/* Gets a place by its name. The caller sets landmark->struct_size.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT, MAQ_ERROR_NOT_FOUND (the model has no such place). Does not block. */
MAQ_API maq_status maq_head_get_landmark(const maq_head* head, const char* name, maq_head_landmark* landmark);

/* Fills `options` with the defaults and sets struct_size. `struct_size` is sizeof(maq_head_mesh_options) of the caller.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_head_mesh_options_init(maq_head_mesh_options* options, uint32_t struct_size);

/* Gets the head's surface as a mesh. `options` may be NULL for the defaults. The caller sets mesh->struct_size. The
 * arrays are the head's and stay until a mesh with other options is asked for.
 * One at a time, with maq_head_export. Errors: MAQ_ERROR_INVALID_ARGUMENT, MAQ_ERROR_UNSUPPORTED (it has no surface),
 * MAQ_ERROR_OUT_OF_MEMORY. Blocks while it is made, a second or less with the defaults. */
MAQ_API maq_status maq_head_get_mesh(maq_head* head, const maq_head_mesh_options* options, maq_head_mesh* mesh);

/* Writes that mesh to a file, by the ending of `path`: .glb (glTF 2.0), .obj with a .mtl beside it, or .ply (binary,
 * with template points), the first two with the texture where the head has one. In files x is to the person's left, y
 * up, z to the front, as glTF has it (docs/formats.md). They appear atomically and replace existing ones. `options` as
 * above. One at a time, with maq_head_get_mesh. Errors: as maq_head_get_mesh, and MAQ_ERROR_UNWRITABLE. Blocks while
 * the mesh is made and written. */
MAQ_API maq_status maq_head_export(maq_head* head, const char* path, const maq_head_mesh_options* options);

#ifdef __cplusplus
}
#endif

#endif /* MAQUETTE_HEAD_H_ */
