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

#include "maquette/pinhole_camera.h"

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
                          network's colours, in the photos' light, elsewhere. 0 (default): heads have none, and hold no
                          part of a photo. With 1024 a fit takes 140 MB of memory more, and a second or two. */
  int32_t texture_mirrored; /* 1: where no photo sees one side of the head, it looks as the other; 0 (default): as the
                               network has it */
  int32_t texture_unlit;    /* 1: the photos' light from one side is taken out of the texture, as far as it can be told
                               from the colours, so that an app can light the head anew; 0 (default): it stays */
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
  MAQ_HEAD_SCALE_GIVEN = 1, /* a distance that was known (maq_head_scale_by_distance) */
  MAQ_HEAD_SCALE_DEPTH = 2  /* a depth camera (maq_head_scale_by_depth) */
} maq_head_scale;

typedef struct maq_head_info {
  uint32_t struct_size;
  uint32_t photo_count;    /* that it was fitted to */
  uint32_t landmark_count; /* places with a name */
  maq_head_scale scale;
  float scale_sigma;   /* standard deviation of its size, as a fraction of it: 0.04 is 4 %; 0: not known */
  uint32_t texture_px; /* pixels a side; 0: it has no texture */
} maq_head_info;

/* Which vertices and triangles a mesh has. */
typedef enum maq_head_topology {
  MAQ_HEAD_TOPOLOGY_FIELD = 0,   /* those of the surface as it is, closed */
  MAQ_HEAD_TOPOLOGY_TEMPLATE = 1 /* those of the template head, wrapped onto the surface: the same for every head, with
                                    texture coordinates, eyeballs, teeth and tongue, and morph targets for facial
                                    actions; open at the neck. Beards, hair and glasses are as coarse as the skin is. */
} maq_head_topology;

/* How fine a mesh is, and of which vertices. */
typedef struct maq_head_mesh_options {
  uint32_t struct_size;
  uint32_t triangle_count; /* about as many, 100 or more: of the full mesh as many edges are collapsed as that takes,
                              those first that move the surface least. 0 (default): 60,000, or with a cell_m all;
                              MAQ_HEAD_ALL_TRIANGLES: all. */
  double cell_m; /* distance of neighbouring vertices of the full mesh, about, 0.0005 to 0.02; 0 (default): 0.0016, or
                    0.0021 where no more than 60,000 triangles are to be left */
  maq_head_topology topology; /* default MAQ_HEAD_TOPOLOGY_FIELD. The template's has its own triangles: triangle_count
                                 and cell_m must be 0 then. */
  const char* bundle_path;    /* for the template's topology of a head from a file, which has no template in it: the
                                 bundle's folder; NULL (default): bundle_files, or without them the bundle installed
                                 with the library. A head that was fitted, or has got a template, keeps its own. */
  const maq_memory_file* bundle_files; /* the bundle's files in memory, instead of bundle_path; default NULL */
  uint32_t bundle_file_count;          /* default 0 */
} maq_head_mesh_options;

#define MAQ_HEAD_ALL_TRIANGLES 0xFFFFFFFFu

/* A mesh: closed, without holes, cut off below the chin. Where there is a texture, vertices around the cut are there
 * twice, once for the cap. With the template's topology it is open at the neck, and vertices at seams of the texture
 * are there twice. */
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
  /* Of a head with a texture, else NULL and 0; the coordinates with the template's topology, too. */
  const float* texture_coordinates; /* [vertex_count][2]: u to the right, v down, 0 to 1 */
  const uint8_t* texture_jpeg;      /* a JPEG file, square: a disc, its middle the crown, the face in its lower half */
  uint32_t texture_bytes;           /* of it */
  uint32_t morph_target_count;      /* with the template's topology; else 0 */
} maq_head_mesh;

/* How the vertices of a mesh move in a facial action at its strongest: to position + weight * move, with weights of 0
 * to 1, and the sum of the moves where there are several actions. */
typedef struct maq_head_morph_target {
  uint32_t struct_size;
  uint32_t vertex_count;    /* that move; all others stay */
  const char* name;         /* such as jawOpen, eyeBlinkLeft: the 52 of ARKit; left is the person's. The head's. */
  const uint32_t* vertices; /* [vertex_count], increasing */
  const float* moves_m;     /* [vertex_count][3] */
} maq_head_morph_target;

/* A place of the head that has a name. */
typedef struct maq_head_landmark {
  uint32_t struct_size;
  float sigma_m; /* standard deviation of each coordinate that the shape model and the photos leave: more where they do
                    not show it, or along their lines of sight; that of the size comes on top */
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

/* Adds the photos of this builder to those that `head` was fitted to: later fits go on from what these said, without
 * having them. It must be of the same person, fitted with the same bundle; one head at most: another takes its place. A
 * fit then has the cameras of `head` first, as they were, and a head of known size keeps it; of colours the photos of
 * this builder say more. With a texture asked for, that of `head` shows what they do not see. `head` is not kept.
 * One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT (it has more than 192 photos), MAQ_ERROR_UNSUPPORTED (it is of
 * another bundle, or from a file of version 1). Blocks for some milliseconds. */
MAQ_API maq_status maq_head_builder_add_head(maq_head_builder* builder, const maq_head* head);

/* Forgets the photos, and the head that they would be added to, for a head of another person.
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

/* Reads such a file that is in memory, which is copied. Errors and the rest as for maq_head_open, but for
 * MAQ_ERROR_NOT_FOUND. */
MAQ_API maq_status maq_head_open_memory(maq_context* context, const void* data, size_t size_bytes, maq_head** head);

/* Writes the head to a file, some 64 KB and its texture (docs/formats.md), which appears atomically and replaces an
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

/* ---- Size ---- */

/* Makes the same head of the size at which the places `from` and `to` are `distance_m` (0.001 to 10) apart, such as the
 * distance of pupil_left and pupil_right that an optician measured. maq_head_info of `*scaled` says
 * MAQ_HEAD_SCALE_GIVEN, and with scale_sigma how sure the shape model is of these places; `head` stays as it is.
 * `*scaled` is the caller's, to be given to maq_head_destroy.
 * One at a time, with maq_head_get_mesh. Errors: MAQ_ERROR_INVALID_ARGUMENT (also where both are the same place),
 * MAQ_ERROR_NOT_FOUND (the model has no such place). Does not block. */
MAQ_API maq_status maq_head_scale_by_distance(maq_head* head, const char* from, const char* to, double distance_m,
                                              maq_head** scaled);

/* Makes the same head of the size at which it lies where a depth camera saw it. `frame` has depth of the same view as
 * the photo with the camera at `index` (maq_head_get_camera), in any size: its own pixels, or what came with the
 * picture. The photo should have been given its focal_px: an estimated one that is 10 % too long makes the head as much
 * too small. maq_head_info says MAQ_HEAD_SCALE_DEPTH, and how far the depth of its pixels spreads. The rest as above.
 * One at a time, with maq_head_get_mesh. Errors: MAQ_ERROR_INVALID_ARGUMENT (index out of range, no depth, another
 * shape than the photo's), MAQ_ERROR_NOT_FOUND (half of the head has no depth that agrees with it),
 * MAQ_ERROR_OUT_OF_MEMORY. Blocks for some 100 ms. */
MAQ_API maq_status maq_head_scale_by_depth(maq_head* head, uint32_t index, const maq_frame* frame, maq_head** scaled);

/* ---- Meshes ---- */

/* Fills `options` with the defaults and sets struct_size. `struct_size` is sizeof(maq_head_mesh_options) of the caller.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_head_mesh_options_init(maq_head_mesh_options* options, uint32_t struct_size);

/* Gets the head's surface as a mesh. `options` may be NULL for the defaults. The caller sets mesh->struct_size. The
 * arrays are the head's and stay until a mesh with other options is asked for.
 * One at a time, with maq_head_export. Errors: MAQ_ERROR_INVALID_ARGUMENT, MAQ_ERROR_UNSUPPORTED (it has no surface, or
 * the bundle no template), MAQ_ERROR_NOT_FOUND and MAQ_ERROR_BAD_BUNDLE (of the template's bundle),
 * MAQ_ERROR_OUT_OF_MEMORY. Blocks while it is made, a second or less with the defaults. */
MAQ_API maq_status maq_head_get_mesh(maq_head* head, const maq_head_mesh_options* options, maq_head_mesh* mesh);

/* Gets a morph target of the mesh that maq_head_get_mesh, maq_head_export or maq_head_renderer_create made last, by its
 * index below morph_target_count. The caller sets target->struct_size. The arrays are the head's and stay as that
 * mesh's do. One at a time, with maq_head_get_mesh. Errors: MAQ_ERROR_INVALID_ARGUMENT (index out of range). Does not
 * block. */
MAQ_API maq_status maq_head_get_morph_target(const maq_head* head, uint32_t index, maq_head_morph_target* target);

/* Writes that mesh to a file, by the ending of `path`: .glb (glTF 2.0), .obj with a .mtl beside it, or .ply (binary,
 * with template points), the first two with the texture where the head has one, the first with morph targets. In files
 * x is to the person's left, y up, z to the front, as glTF has it (docs/formats.md). They appear atomically and replace
 * existing ones. `options` as above. One at a time, with maq_head_get_mesh. Errors: as maq_head_get_mesh, and
 * MAQ_ERROR_UNWRITABLE. Blocks while the mesh is made and written. */
MAQ_API maq_status maq_head_export(maq_head* head, const char* path, const maq_head_mesh_options* options);

/* ---- Previews ---- */

/* Receives the head as far as it is fitted, on the thread of maq_head_builder_fit, which waits: the callback's time is
 * a part of the fit's. `head` is the callback's, to be given to maq_head_destroy. It must not call the builder, nor
 * throw. */
typedef void (*maq_head_preview_callback)(void* user_data, maq_head* head);

/* Has `preview` called during every later maq_head_builder_fit: with the head that the network saw, then every
 * `interval_s` seconds (0 to 3600); not where the fit is given no time. NULL: no longer. `user_data` is passed to it.
 * One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_head_builder_set_preview(maq_head_builder* builder, double interval_s,
                                                maq_head_preview_callback preview, void* user_data);

/* ---- Pictures ----
 *
 *   maq_head_renderer_create(context, NULL, head, &renderer);
 *   maq_head_renderer_get_camera(renderer, 0.5, 0, 640, 480, &camera);  or one of the app, or maq_head_get_camera
 *   maq_head_renderer_run(renderer, &camera, &image);
 *   maq_head_image_save(image, "head.png", 1);
 */

typedef struct maq_head_renderer maq_head_renderer;
typedef struct maq_head_image maq_head_image;

/* What the colours of a picture show. */
typedef enum maq_head_shading {
  MAQ_HEAD_SHADING_COLOUR = 1,   /* the head's texture, where its mesh has one, else its colours; in soft light */
  MAQ_HEAD_SHADING_SHAPE = 2,    /* grey, in soft light */
  MAQ_HEAD_SHADING_NORMALS = 3,  /* red to the right, green up, blue to the camera, as in normal maps */
  MAQ_HEAD_SHADING_TEMPLATE = 4, /* template points: red to the person's left, green to the back, blue up */
  MAQ_HEAD_SHADING_DEPTH = 5     /* near is white, far is black */
} maq_head_shading;

typedef struct maq_head_renderer_config {
  uint32_t struct_size;
  int32_t threads;                   /* 1 to 64; 0 (default): the machine's large cores, at most 4 */
  const maq_head_mesh_options* mesh; /* that is drawn; default NULL: the defaults. Read once. */
  double near_m;                     /* what is nearer to the camera, along its axis, is not drawn; default 0.01 */
  maq_head_shading shading;          /* default MAQ_HEAD_SHADING_COLOUR */
  float light;            /* how much darker is what is turned away from the light, 0 (not at all) to 1 (black); default
                             0.35 */
  int32_t smooth_edges;   /* 1 (default): edges are drawn with four samples a pixel; 0: with one, which is faster */
  int32_t use_background; /* 1: pictures are composed over `background` by their alpha; 0 (default): they are not, and
                             colours are 0 where there is no head */
  uint8_t background[3];  /* red, green, blue; with use_background */
  uint32_t image_pool_size; /* images the app may hold at once, 1 to 64; default 4 */
} maq_head_renderer_config;

/* The planes of an image, each of the camera's size. */
typedef enum maq_head_plane {
  MAQ_HEAD_PLANE_BGR = 1,     /* three bytes a pixel: blue, green, red; what maq_head_shading says */
  MAQ_HEAD_PLANE_ALPHA = 2,   /* one byte a pixel: coverage by the head, 0 to 255 */
  MAQ_HEAD_PLANE_DEPTH = 3,   /* a float a pixel: metres along the optical axis; 0 where there is no head */
  MAQ_HEAD_PLANE_NORMALS = 4, /* three floats a pixel: outwards, in the camera (x to the right, y down, z forward), of
                                 length 1; 0 where there is no head */
  MAQ_HEAD_PLANE_TEMPLATE_POINTS = 5 /* three floats a pixel: metres, on the template head; 0 where there is no head */
} maq_head_plane;

/* Gets the camera of a photo that the head was fitted to, by its index below photo_count of maq_head_info: what
 * maq_head_renderer_run draws with it lies on the head in the photo. The caller sets camera->struct_size.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT (index out of range). Does not block. */
MAQ_API maq_status maq_head_get_camera(const maq_head* head, uint32_t index, maq_pinhole_camera* camera);

/* Fills `config` with the defaults and sets struct_size. `struct_size` is sizeof(maq_head_renderer_config) of the
 * caller. Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_head_renderer_config_init(maq_head_renderer_config* config, uint32_t struct_size);

/* Creates a renderer of a head, which it needs no longer afterwards. `config` may be NULL for the defaults. `*renderer`
 * is the caller's, to be given to maq_head_renderer_destroy.
 * One at a time with maq_head_get_mesh of the head, whose mesh is made or used. Errors: MAQ_ERROR_INVALID_ARGUMENT,
 * MAQ_ERROR_UNSUPPORTED (it has no surface), MAQ_ERROR_OUT_OF_MEMORY. Blocks while the mesh is made, a second or less
 * with the defaults. */
MAQ_API maq_status maq_head_renderer_create(maq_context* context, const maq_head_renderer_config* config,
                                            maq_head* head, maq_head_renderer** renderer);

/* Frees the renderer (NULL is fine). Images still held stay valid until they are released.
 * Once for each renderer, from any thread, while it does not render. Does not block. */
MAQ_API void maq_head_renderer_destroy(maq_head_renderer* renderer);

/* Fills `camera` with one that sees the whole head from far enough, whichever way it is turned, in a picture of
 * width_px x height_px. `yaw_rad`: how far it stands to the person's left of the front, `pitch_rad`: how far above. The
 * caller sets camera->struct_size.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT (an angle that is not finite), MAQ_ERROR_IMAGE_SIZE. Does not block.
 */
MAQ_API maq_status maq_head_renderer_get_camera(const maq_head_renderer* renderer, double yaw_rad, double pitch_rad,
                                                int32_t width_px, int32_t height_px, maq_pinhole_camera* camera);

/* Has later pictures show something else.
 * One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_head_renderer_set_shading(maq_head_renderer* renderer, maq_head_shading shading);

/* Renders the head as the camera sees it, in a picture of the camera's size. The world is that of the head: metres, x
 * to the person's left, y to the back, z up. The camera should be outside of the head: it has no inside. `*image` comes
 * from a pool of image_pool_size: give it back with maq_head_image_release.
 * One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT (an invalid camera, or one with distortion), MAQ_ERROR_IMAGE_SIZE,
 * MAQ_ERROR_POOL_EMPTY, MAQ_ERROR_OUT_OF_MEMORY. Blocks while it renders, milliseconds. */
MAQ_API maq_status maq_head_renderer_run(maq_head_renderer* renderer, const maq_pinhole_camera* camera,
                                         maq_head_image** image);

/* Gives the image back (NULL is fine). Pointers into it are invalid afterwards.
 * Once for each image, from any thread. Does not block. */
MAQ_API void maq_head_image_release(maq_head_image* image);

/* Gets a plane: rows of `*stride_bytes` bytes, inside the image.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_head_image_get_plane(const maq_head_image* image, maq_head_plane plane, const void** pixels,
                                            size_t* stride_bytes);

/* Writes the colours to a file, in the format of the path's extension: PNG (.png), lossless, with alpha where
 * `with_alpha` is 1, or JPEG (.jpg, .jpeg) at quality 95, without alpha. The file is written atomically and replaces
 * an existing one; its folder must exist.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT (another extension, alpha in a JPEG file), MAQ_ERROR_UNWRITABLE,
 * MAQ_ERROR_RUNTIME_LIBRARY (libmaquette_files.so is missing). Blocks while it is written. */
MAQ_API maq_status maq_head_image_save(const maq_head_image* image, const char* path, int32_t with_alpha);

#ifdef __cplusplus
}
#endif

#endif /* MAQUETTE_HEAD_H_ */
