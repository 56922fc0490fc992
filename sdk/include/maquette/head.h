/* Heads: an animatable, textured 3D head in metres, from one photo of a person or from several.
 *
 *   maq_head_builder_create(context, NULL, &builder);
 *   maq_head_builder_add_photo(builder, frame, NULL);
 *   maq_head_builder_fit(builder, 3.0, &head);
 *   maq_head_save(head, "head.maqh");
 *   maq_head_mesh_create(head, NULL, &mesh);
 *   maq_head_mesh_save(mesh, "head.glb");
 *
 * A face is biometric data: ask the person, and protect heads like passwords. Nothing leaves the device. A builder
 * keeps the part of each photo around the head until maq_head_builder_clear or maq_head_builder_destroy. A head and its
 * file hold no photo, unless the builder's config asks for a texture. A texture has the pixels of the face.
 */
#ifndef MAQUETTE_HEAD_H_
#define MAQUETTE_HEAD_H_

#include "maquette/image.h"
#include "maquette/pinhole_camera.h"

#ifdef __cplusplus
extern "C" {
#endif

/* The head's frame: metres, x to the person's left, y up, z to the front, as in glTF. Its origin is the middle of the
 * head. The template head is the SDK's standard head. Each of its points, such as the tip of the nose, has a
 * corresponding point on every head. A network, the encoder, estimates which template point each part of a photo shows.
 */

typedef struct maq_head_builder maq_head_builder;
typedef struct maq_head maq_head;
typedef struct maq_head_mesh maq_head_mesh;
typedef struct maq_head_renderer maq_head_renderer;

/* ---- Fitting ---- */

/* Whether heads get a texture. Values never change meaning; new ones are added at the end. */
typedef enum maq_head_texture {
  MAQ_HEAD_TEXTURE_DEFAULT = 0, /* the SDK's choice: MAQ_HEAD_TEXTURE_ON in this version */
  MAQ_HEAD_TEXTURE_OFF = 1,     /* heads have only the network's colours, and hold no part of a photo */
  MAQ_HEAD_TEXTURE_ON = 2 /* the photos' pixels where a photo shows the surface well, the network's colours elsewhere */
} maq_head_texture;

/* All zero is the default. */
typedef struct maq_head_builder_config {
  uint32_t struct_size;
  maq_model_options model;  /* the encoder network; model.threads also counts for the fit. The bundle has the task
                               "heads"; the installed one is share/maquette/models/heads-int8. */
  maq_head_texture texture; /* a texture of 1024 pixels a side takes 140 MB of memory and one to two seconds more */
  uint32_t texture_px;      /* pixels a side of the texture, 256 to 2048; 0: 1024. Not with MAQ_HEAD_TEXTURE_OFF. */
  int32_t delight_texture;  /* 1: directional light of the photos is removed from the texture, as far as it can be
                               estimated. An app can then relight the head. 0: it stays. */
  maq_progress_callback progress_callback; /* of maq_head_builder_fit; may be NULL */
  void* progress_user_data;                /* passed to progress_callback */
} maq_head_builder_config;

/* Hints of the app about a photo. All zero is the default: nothing is known. */
typedef struct maq_head_photo {
  uint32_t struct_size;
  float box_px[4]; /* of the head with its hair: left, top, right, bottom; right and bottom are exclusive. The box may
                      reach beyond the photo. All 0: the head is detected; slower, and reliable only for one large head
                      per photo. */
  float roll_rad;  /* rotation of the head in the photo's plane, clockwise from upright, -7 to 7; a value
                      within some 30 degrees is enough */
  float focal_px;  /* focal length in pixels of this photo, 0.001 to 1e9. 0: unknown; estimated together with the
                      head */
} maq_head_photo;

/* The result for one photo. */
typedef struct maq_head_photo_info {
  uint32_t struct_size;
  float box_px[4];     /* box of the head: given, or detected */
  float head_coverage; /* fraction of the encoder's crop that shows the head, 0 to 1 */
  /* The other fields describe the latest maq_head_builder_fit, and are 0 before. */
  int32_t is_used; /* 1: the head was fitted to the photo. 0: rejected: no head, or a different person. */
  float focal_px;  /* focal length, given or estimated; 0 if the photo was not used */
  float rms_px;    /* root mean square distance between projected head points and the network's estimates; 0 if the
                      photo was not used */
} maq_head_photo_info;

/* Wall-clock times in milliseconds, and counts, for the photos so far and for the latest fit. */
typedef struct maq_head_build_stats {
  uint32_t struct_size;
  uint32_t photo_count;
  uint32_t used_photo_count; /* photos that the head was fitted to */
  float encode_ms;           /* the network, in maq_head_builder_add_photo, over all photos */
  float pose_ms;             /* first stage of the fit: cameras and a first shape */
  float fit_ms;              /* second stage: the fit to the pixels */
  float total_ms;            /* total of maq_head_builder_fit */
  int32_t step_count;        /* steps of the fit to the pixels */
  maq_provider provider;     /* provider in use for the network */
  int32_t threads;
} maq_head_build_stats;

/* Fills `config` with the defaults and sets struct_size. `struct_size` is sizeof(maq_head_builder_config) of the
 * caller. Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_head_builder_config_init(maq_head_builder_config* config, uint32_t struct_size);

/* Fills `photo` with the defaults and sets struct_size. `struct_size` is sizeof(maq_head_photo) of the caller.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_head_photo_init(maq_head_photo* photo, uint32_t struct_size);

/* Loads a model bundle of the task "heads" and checks sizes and SHA-256 of its files. `config` may be NULL for the
 * defaults. The caller owns `*builder`; give it to maq_head_builder_destroy.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT, MAQ_ERROR_NOT_FOUND, MAQ_ERROR_BAD_BUNDLE, MAQ_ERROR_UNSUPPORTED (a
 * bundle of another task), MAQ_ERROR_RUNTIME_LIBRARY. Blocks while files are read and the network is prepared. */
MAQ_API maq_status maq_head_builder_create(maq_context* context, const maq_head_builder_config* config,
                                           maq_head_builder** builder);

/* Frees the builder and its parts of photos (NULL is fine). Heads stay valid.
 * Once for each builder, from any thread. Does not block. */
MAQ_API void maq_head_builder_destroy(maq_head_builder* builder);

/* Runs the encoder on a photo of the head: a colour or grey image of any format, without lens distortion. Several
 * photos must show one person; each may have its own camera. `photo` may be NULL for the defaults. The index of the
 * photo is the number of photos before it. The frame is not kept; its part around the head is. On failure the builder
 * stays as it was.
 * One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT (a box that is empty, not finite or outside of the photo; a focal
 * length that is not positive; more than 64 photos). MAQ_ERROR_NOT_FOUND (no head). MAQ_ERROR_UNSUPPORTED (a depth
 * image). MAQ_ERROR_BAD_BUNDLE (the graph contradicts the manifest). MAQ_ERROR_INFERENCE. MAQ_CANCELLED. Blocks while
 * the network runs: up to two passes with a box, more if the head is detected. */
MAQ_API maq_status maq_head_builder_add_photo(maq_head_builder* builder, const maq_frame* frame,
                                              const maq_head_photo* photo);

/* Uses `head` as prior for later fits, which do not need its photos again. `head` must show the same person and come
 * from the same bundle. A builder has one prior head: another call replaces it. In a head that is fitted afterwards,
 * the cameras of `head` come first, unchanged. A known size stays. Colours depend more on this builder's photos. Unless
 * the config has MAQ_HEAD_TEXTURE_OFF, the texture of `head` fills the parts that these photos do not show. `head` is
 * not kept. One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT (it has more than 192 photos), MAQ_ERROR_UNSUPPORTED
 * (another bundle, or a file of version 1). Blocks for some milliseconds. */
MAQ_API maq_status maq_head_builder_add_head(maq_head_builder* builder, const maq_head* head);

/* Forgets the photos and the prior head. Another person's head can be fitted afterwards.
 * One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_head_builder_clear(maq_head_builder* builder);

/* Fits one head to the photos so far. The first stage finds cameras and a shape from the network's output, in
 * milliseconds; with `seconds` 0 this is the result. The second stage fits shape and colours to the pixels, for up to
 * `seconds` (0 to 3600) or until it converges. Some 3 seconds are enough on a laptop. Parts that no photo shows follow
 * from similar heads. Photos that show no head or a different person are rejected, as long as one photo is left
 * (maq_head_photo_info). More photos may be added later, for another fit to all photos. Equal photos, number of steps,
 * threads and processor give equal results. The caller owns `*head`; give it to maq_head_destroy.
 * One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT (no photos), MAQ_ERROR_NOT_FOUND (no photo shows a head),
 * MAQ_CANCELLED. Blocks until the head is fitted. */
MAQ_API maq_status maq_head_builder_fit(maq_head_builder* builder, double seconds, maq_head** head);

/* Cancels the running maq_head_builder_add_photo or maq_head_builder_fit, or else the next one: it returns
 * MAQ_CANCELLED. Later calls run as usual.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_head_builder_cancel(maq_head_builder* builder);

/* Gets times and counts so far. The caller sets stats->struct_size.
 * One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_head_builder_get_stats(const maq_head_builder* builder, maq_head_build_stats* stats);

/* Gets the result for the photo at `index`. The caller sets info->struct_size.
 * One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT (index out of range). Does not block. */
MAQ_API maq_status maq_head_builder_get_photo(const maq_head_builder* builder, uint32_t index,
                                              maq_head_photo_info* info);

/* Receives the head in its current state, on the thread of maq_head_builder_fit. The fit waits: the callback's time is
 * part of the fit's time. The callback owns `head` and gives it to maq_head_destroy. It must not use the builder,
 * except for maq_head_builder_cancel, and must not throw. */
typedef void (*maq_head_preview_callback)(void* user_data, maq_head* head);

/* Sets a callback for later fits. They call `preview` first with the network's head, then every `interval_s` seconds (0
 * to 3600). Fits with `seconds` 0 have no preview. NULL ends previews. `user_data` is passed to `preview`.
 * One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_head_builder_set_preview(maq_head_builder* builder, double interval_s,
                                                maq_head_preview_callback preview, void* user_data);

/* ---- Heads ---- */

/* Where the size of a head comes from. */
typedef enum maq_head_scale {
  MAQ_HEAD_SCALE_PRIOR = 0, /* the mean size of similar heads: photos alone do not tell the size */
  MAQ_HEAD_SCALE_GIVEN = 1, /* a known distance (maq_head_scale_by_distance) */
  MAQ_HEAD_SCALE_DEPTH = 2  /* a depth camera (maq_head_scale_by_depth) */
} maq_head_scale;

typedef struct maq_head_info {
  uint32_t struct_size;
  uint32_t photo_count;    /* photos that the head was fitted to */
  uint32_t landmark_count; /* named points */
  maq_head_scale scale;
  float scale_sigma;   /* standard deviation of the size, as a fraction of it: 0.04 is 4 %; 0: unknown */
  uint32_t texture_px; /* pixels a side of the texture; 0: the head has none */
} maq_head_info;

/* A named point of the head. */
typedef struct maq_head_landmark {
  uint32_t struct_size;
  float sigma_m; /* standard deviation of each coordinate, from shape model and photos. It is larger where no photo
                    shows the point, and along the lines of sight. scale_sigma of maq_head_info comes on top. */
  double point_m[3];
} maq_head_landmark;

/* Reads a file that maq_head_save wrote; no bundle is needed. The caller owns `*head`; give it to maq_head_destroy.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT, MAQ_ERROR_NOT_FOUND, MAQ_ERROR_UNREADABLE (not a head, truncated,
 * damaged), MAQ_ERROR_UNSUPPORTED (another version). Blocks while the file is read. */
MAQ_API maq_status maq_head_open(maq_context* context, const char* path, maq_head** head);

/* Reads a head file in memory, of any alignment; it is copied. Otherwise like maq_head_open. */
MAQ_API maq_status maq_head_open_memory(maq_context* context, const void* data, size_t size_bytes, maq_head** head);

/* Frees the head (NULL is fine). Its meshes and renderers stay valid.
 * Once for each head, from any thread. Does not block. */
MAQ_API void maq_head_destroy(maq_head* head);

/* Writes the head to a file (.maqh): some 64 KB, plus the texture. It appears atomically and replaces an existing file.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT, MAQ_ERROR_UNWRITABLE. Blocks until the file is on the disk. */
MAQ_API maq_status maq_head_save(const maq_head* head, const char* path);

/* Describes the head. The caller sets info->struct_size.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_head_get_info(const maq_head* head, maq_head_info* info);

/* Returns the name of the landmark at `index`, NULL if there is none. The SDK's model has: nose_tip, nose_bridge, chin,
 * crown, pupil_left, pupil_right, temple_left, temple_right, ear_top_left, ear_top_right, ear_bottom_left,
 * ear_bottom_right. Left is the person's left. The text is the head's. Any thread. Does not fail or block. */
MAQ_API const char* maq_head_get_landmark_name(const maq_head* head, uint32_t index);

/* Gets a landmark by its name. The caller sets landmark->struct_size.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT, MAQ_ERROR_NOT_FOUND (the model has no such landmark). Does not block.
 */
MAQ_API maq_status maq_head_get_landmark(const maq_head* head, const char* name, maq_head_landmark* landmark);

/* Gets the camera of a photo that the head was fitted to. `index` is below photo_count of maq_head_info. An image that
 * is rendered with this camera matches the head in the photo. The caller sets camera->struct_size.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT (index out of range). Does not block. */
MAQ_API maq_status maq_head_get_camera(const maq_head* head, uint32_t index, maq_pinhole_camera* camera);

/* Copies the head and scales it: the landmarks `from` and `to` are then `distance_m` (0.001 to 10) apart. An example is
 * the distance of pupil_left and pupil_right that an optician measured. The copy has MAQ_HEAD_SCALE_GIVEN; its
 * scale_sigma is the model's uncertainty of these landmarks. The caller owns `*scaled`; give it to maq_head_destroy.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT (also: both are the same point), MAQ_ERROR_NOT_FOUND (the model has no
 * such landmark). Does not block. */
MAQ_API maq_status maq_head_scale_by_distance(const maq_head* head, const char* from, const char* to, double distance_m,
                                              maq_head** scaled);

/* Copies the head and scales it to fit a depth image. `frame` is a depth image, or an image with depth, in any size. It
 * shows the view of the photo with the camera at `index` (maq_head_get_camera). Give this photo its focal_px: an
 * estimate that is 10 % too long makes the head 10 % too small. The copy has MAQ_HEAD_SCALE_DEPTH; its scale_sigma is
 * the spread of the pixels' depth. The caller owns `*scaled`; give it to maq_head_destroy.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT (index out of range, no depth, another aspect ratio than the photo's).
 * MAQ_ERROR_NOT_FOUND (less than half of the head has matching depth). MAQ_ERROR_OUT_OF_MEMORY. Blocks for some 100
 * ms. */
MAQ_API maq_status maq_head_scale_by_depth(const maq_head* head, uint32_t index, const maq_frame* frame,
                                           maq_head** scaled);

/* ---- Meshes ---- */

/* For maq_head_mesh_config.triangle_count: no triangle is removed. */
#define MAQ_HEAD_ALL_TRIANGLES 0xFFFFFFFFu

/* All zero is the default: an animatable head. Its vertices, triangles and texture coordinates are the same for
 * every head. It has eyeballs, teeth and tongue, morph targets for facial actions and visemes, and joints in .glb
 * files. It is open at the neck. Hair, beards and glasses are as coarse as skin. With triangle_count or cell_m, the
 * mesh is instead the dense surface itself, closed, without morph targets. */
typedef struct maq_head_mesh_config {
  uint32_t struct_size;
  maq_model_options model; /* threads: 0 means the threads of the builder that fitted the head. A bundle is read only
                              for the animatable mesh of a head from a file, because the file has no template head. The
                              installed one is share/maquette/models/heads-int8. Other fields have no effect. */
  uint32_t triangle_count; /* approximate number of triangles of the dense surface, 100 or more; edges are collapsed in
                              the order of the smallest change. 0: the animatable head, or all if cell_m is set;
                              MAQ_HEAD_ALL_TRIANGLES: all */
  double cell_m; /* approximate distance between neighbouring vertices of the dense surface before edges are collapsed,
                    0.0005 to 0.02. 0: 0.0021, or 0.0016 for more than 60,000 triangles */
} maq_head_mesh_config;

/* The arrays of a mesh. The dense surface is closed, without holes, and ends at a plane below the chin. If it has a
 * texture, the vertices at that plane appear twice, once for the cap. In the animatable head, vertices at texture seams
 * appear twice. */
typedef struct maq_head_mesh_data {
  uint32_t struct_size;
  uint32_t vertex_count;
  uint32_t triangle_count;
  uint32_t morph_target_count;    /* 0 of the dense surface */
  const float* positions_m;       /* [vertex_count][3] */
  const float* normals;           /* [vertex_count][3], outwards, of length 1 */
  const uint8_t* colours_rgb;     /* [vertex_count][3], sRGB */
  const float* template_points_m; /* [vertex_count][3]: the point of the template head. Equal points mean the same part
                                     of every head, such as the tip of the nose. */
  const uint32_t* triangles;      /* [triangle_count][3], counter-clockwise seen from outside */
  const float* texture_coordinates; /* [vertex_count][2]: u to the right, v down, 0 to 1. NULL of the dense surface of a
                                       head without a texture. */
  const uint8_t*
      texture_jpeg;       /* a square JPEG file; NULL if the head has no texture. Of the dense surface it is a disc,
                             the crown in its middle, the face in its lower half. Of the animatable head it is in
                             the texture coordinates of MakeHuman, with twice the pixels a side, up to 2048. */
  uint32_t texture_bytes; /* size of texture_jpeg */
  float simplification_error_m; /* largest distance between a vertex of the full mesh and this mesh; 0 if nothing was
                                   removed */
} maq_head_mesh_data;

/* A facial action or a viseme at its strongest: vertices go to position + weight * delta, with a weight of 0 to 1. The
 * deltas of several actions add up. Texts and arrays are the mesh's. */
typedef struct maq_head_morph_target {
  uint32_t struct_size;
  uint32_t vertex_count; /* vertices that move; all others stay. 0 of viseme_sil, silence: then there are no arrays */
  const char* name; /* one of ARKit's 52 actions, such as jawOpen or eyeBlinkLeft; left is the person's left. Or one of
                       15 visemes for speech, such as viseme_aa. */
  const uint32_t* vertices; /* [vertex_count], increasing */
  const float* deltas_m;    /* [vertex_count][3] */
} maq_head_morph_target;

/* Fills `config` with the defaults and sets struct_size. `struct_size` is sizeof(maq_head_mesh_config) of the caller.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_head_mesh_config_init(maq_head_mesh_config* config, uint32_t struct_size);

/* Creates a mesh of the head's surface. `config` may be NULL for the defaults. The mesh does not need the head
 * afterwards. The caller owns `*mesh`; give it to maq_head_mesh_destroy.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT, MAQ_ERROR_UNSUPPORTED (the head has no surface, or the bundle no
 * template), MAQ_ERROR_UNREADABLE (the texture), MAQ_ERROR_NOT_FOUND and MAQ_ERROR_BAD_BUNDLE (the template's bundle),
 * MAQ_ERROR_OUT_OF_MEMORY. Blocks
 * while the mesh is computed, a second or less with the defaults. */
MAQ_API maq_status maq_head_mesh_create(const maq_head* head, const maq_head_mesh_config* config, maq_head_mesh** mesh);

/* Frees the mesh (NULL is fine); its arrays are invalid afterwards. Renderers stay valid.
 * Once for each mesh, from any thread. Does not block. */
MAQ_API void maq_head_mesh_destroy(maq_head_mesh* mesh);

/* Gets counts and arrays. The caller sets data->struct_size. The arrays are the mesh's.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_head_mesh_get_data(const maq_head_mesh* mesh, maq_head_mesh_data* data);

/* Gets the morph target at `index`, below morph_target_count. The caller sets target->struct_size.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT (index out of range). Does not block. */
MAQ_API maq_status maq_head_mesh_get_morph_target(const maq_head_mesh* mesh, uint32_t index,
                                                  maq_head_morph_target* target);

/* Writes the mesh to a file. The extension of `path`, in small letters, chooses the format: .glb (glTF 2.0), .obj with
 * a .mtl file, or .ply (binary, with template points). GLB and OBJ have the texture; GLB also has the morph targets and
 * a skin with the joints Neck, Head, Jaw, LeftEye and RightEye (docs/reference/formats.md). Files appear atomically and
 * replace existing ones.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT (another extension), MAQ_ERROR_UNWRITABLE. Blocks while the files are
 * written. */
MAQ_API maq_status maq_head_mesh_save(const maq_head_mesh* mesh, const char* path);

/* ---- Rendering ----
 *
 *   maq_head_renderer_create(context, NULL, mesh, &renderer);
 *   maq_head_renderer_get_camera(renderer, 0.5, 0, 640, 480, &camera);  or the app's own, or maq_head_get_camera
 *   maq_head_renderer_run(renderer, &camera, &image);
 *   maq_image_save(image, "head.png", MAQ_IMAGE_ALPHA_ON);
 */

/* The meaning of the colours of an image (MAQ_IMAGE_PLANE_BGR). */
typedef enum maq_head_shading {
  MAQ_HEAD_SHADING_COLOUR = 0,   /* the mesh's texture, or its colours if it has none; in soft light */
  MAQ_HEAD_SHADING_SHAPE = 1,    /* grey, in soft light */
  MAQ_HEAD_SHADING_NORMALS = 2,  /* red to the right, green up, blue to the camera, as in normal maps */
  MAQ_HEAD_SHADING_TEMPLATE = 3, /* template points: red to the person's left, green up, blue to the front */
  MAQ_HEAD_SHADING_DEPTH = 4     /* white is near, black is far */
} maq_head_shading;

/* For maq_head_renderer_config.shading_strength: colours are shown without light. */
#define MAQ_HEAD_SHADING_STRENGTH_OFF (-1)

/* All zero is the default. */
typedef struct maq_head_renderer_config {
  uint32_t struct_size;
  int32_t threads; /* 1 to 64; 0: the machine's large cores, at most 4 */
  double near_m;   /* points nearer to the camera along its axis are not drawn, 1e-6 to 1e6. 0: 0.01 */
  maq_head_shading shading;
  float shading_strength;       /* darkening of surfaces that face away from the light, up to 1 (black). 0: 0.35;
                                   MAQ_HEAD_SHADING_STRENGTH_OFF: none */
  int32_t disable_antialiasing; /* 1: one sample a pixel, which is faster; 0: four samples */
  int32_t use_background;       /* 1: images are composed over `background` by their alpha; 0: colours are 0 where no
                                   head is */
  uint8_t background[3];        /* red, green, blue; with use_background */
  uint32_t image_pool_size;     /* images the app may hold at once, 1 to 64. 0: 4 */
} maq_head_renderer_config;

/* Fills `config` with the defaults and sets struct_size. `struct_size` is sizeof(maq_head_renderer_config) of the
 * caller. Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_head_renderer_config_init(maq_head_renderer_config* config, uint32_t struct_size);

/* Creates a renderer of a mesh. The renderer does not need the mesh afterwards. `config` may be NULL for the defaults.
 * The caller owns `*renderer`; give it to maq_head_renderer_destroy.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT, MAQ_ERROR_OUT_OF_MEMORY. Blocks while a texture is decoded. */
MAQ_API maq_status maq_head_renderer_create(maq_context* context, const maq_head_renderer_config* config,
                                            const maq_head_mesh* mesh, maq_head_renderer** renderer);

/* Frees the renderer (NULL is fine). Images still held stay valid until they are released.
 * Once for each renderer, from any thread, while it does not render. Does not block. */
MAQ_API void maq_head_renderer_destroy(maq_head_renderer* renderer);

/* Fills `camera` with a camera that sees the whole head, for an image of width_px x height_px. From the front, the
 * camera moves by `yaw_rad` around the head to the person's left, and by `pitch_rad` upwards. The distance is the same
 * for all angles. The caller sets camera->struct_size.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT (an angle that is not finite), MAQ_ERROR_IMAGE_SIZE. Does not
 * block. */
MAQ_API maq_status maq_head_renderer_get_camera(const maq_head_renderer* renderer, double yaw_rad, double pitch_rad,
                                                int32_t width_px, int32_t height_px, maq_pinhole_camera* camera);

/* Sets the shading of later images.
 * One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_head_renderer_set_shading(maq_head_renderer* renderer, maq_head_shading shading);

/* Renders the head as `camera` sees it, in the camera's size, with the shading of the config or of the latest
 * maq_head_renderer_set_shading. The world is the head's frame, in metres. The caller sets camera->struct_size;
 * maq_head_renderer_get_camera and maq_head_get_camera fill the rest. The camera should be outside of the head:
 * surfaces that face away from it are not drawn. `*image` comes from a pool of image_pool_size: give it back with
 * maq_image_release. It has all planes of maq_image_plane.
 * One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT (an invalid camera, or one with distortion), MAQ_ERROR_IMAGE_SIZE,
 * MAQ_ERROR_POOL_EMPTY, MAQ_ERROR_OUT_OF_MEMORY. Blocks while it renders, some milliseconds. */
MAQ_API maq_status maq_head_renderer_run(maq_head_renderer* renderer, const maq_pinhole_camera* camera,
                                         maq_image** image);

#ifdef __cplusplus
}
#endif

#endif /* MAQUETTE_HEAD_H_ */
