/* Scenes: a place captured as posed photos and a point cloud, made into something that is rendered from new viewpoints,
 * without training for it (NPBG++, arXiv 2203.13318; docs/scenes.md).
 *
 *   maq_capture* capture;          maq_capture_open(context, "folder", &capture);
 *   maq_scene* scene;              maq_scene_build(context, &config, capture, NULL, &scene);
 *                                  maq_scene_save(scene, "place.maqs");
 *   maq_scene_renderer* renderer;  maq_scene_renderer_create(context, &how, scene, &renderer);
 *   maq_scene_image* image;        maq_scene_renderer_run(renderer, &camera, &image);
 *
 * An app that has a cloud and cameras of its own uses a maq_scene_builder and gives it photo after photo.
 *
 * The unit of length is that of the cloud and the cameras, whatever it is ("units of the scene"). The networks are a
 * folder, the bundle of scenes; a scene is rendered with the bundle that it was built with. Objects may be destroyed in
 * any order: each keeps what it needs of those that it was made from. */
#ifndef MAQUETTE_SCENE_H_
#define MAQUETTE_SCENE_H_

#include "maquette/frame.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct maq_capture maq_capture;
typedef struct maq_scene maq_scene;
typedef struct maq_scene_builder maq_scene_builder;
typedef struct maq_scene_renderer maq_scene_renderer;
typedef struct maq_scene_image maq_scene_image;

/* A camera, in the convention of OpenCV: x to the right, y down, z forward; the centre of the top left pixel is (0, 0).
 * A point at X of the world is seen at rotation * (X - centre). */
typedef struct maq_pinhole_camera {
  uint32_t struct_size;
  int32_t width_px; /* of the photo, or of the picture that is to be rendered */
  int32_t height_px;
  double fx_px, fy_px; /* focal lengths, positive */
  double cx_px, cy_px; /* where the optical axis meets the picture; may be outside of it */
  double rotation[9];  /* row by row: world to camera; right-handed, rows of length 1 at right angles (to 0.001) */
  double centre[3];    /* the camera's place in the world, units of the scene */
  /* Of a photo: k1, k2, p1, p2, k3, k4, k5, k6 as in OpenCV; the library undistorts it. 0 for rendered pictures. */
  double distortion[8];
} maq_pinhole_camera;

/* ---- Captures: a folder with photos, their cameras and a cloud ---------------------------------------------------- */

typedef struct maq_capture_info {
  uint32_t struct_size;
  uint32_t view_count;
  uint64_t point_count;
  uint32_t drop_count; /* reasons for which something was dropped, see maq_capture_get_dropped */
  double up[3];        /* the world's up; unit vector */
} maq_capture_info;

/* The texts are the capture's. */
typedef struct maq_capture_view {
  uint32_t struct_size;
  int32_t is_held_out;       /* 1: the capture keeps this photo for comparisons; do not build from it */
  const char* name;          /* as the capture names the photo */
  maq_pinhole_camera camera; /* of the photo after undistortion */
} maq_capture_view;

/* Opens a folder: a COLMAP model (text or binary, in sparse/0, sparse, colmap/sparse/0 or the folder itself) with its
 * photos, or transforms.json as nerfstudio and Instant-NGP write it, with a PLY cloud. Photos are looked at when they are
 * needed. `*capture` is the caller's, to be given to maq_capture_close.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT, MAQ_ERROR_NOT_FOUND (no such folder, no capture or cloud in it),
 * MAQ_ERROR_UNREADABLE (damaged; no photo or point that can be used), MAQ_ERROR_UNSUPPORTED (camera models, sizes).
 * Blocks while cameras and cloud are read. */
MAQ_API maq_status maq_capture_open(maq_context* context, const char* folder, maq_capture** capture);

/* Once for each handle, from any thread (NULL is fine). Scenes made from it and frames of it stay. Does not block. */
MAQ_API void maq_capture_close(maq_capture* capture);

/* Size of the capture. The caller sets info->struct_size.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_capture_get_info(const maq_capture* capture, maq_capture_info* info);

/* The view at `index`, from 0 to maq_capture_info.view_count - 1. The caller sets view->struct_size and
 * view->camera.struct_size.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT (index out of range). Does not block. */
MAQ_API maq_status maq_capture_get_view(const maq_capture* capture, uint32_t index, maq_capture_view* view);

/* Why something of the capture was dropped, with the first that was ("photos without a camera (first: images/7.jpg)"),
 * and how many there are. `index`: from 0 to maq_capture_info.drop_count - 1. The text is the capture's.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT (index out of range). Does not block. */
MAQ_API maq_status maq_capture_get_dropped(const maq_capture* capture, uint32_t index, const char** reason,
                                           uint64_t* count);

/* Reads the photo of a view and undistorts it: BGR of the size of the view's camera. `*frame` is the caller's, to be given
 * to maq_frame_release.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT, MAQ_ERROR_NOT_FOUND, MAQ_ERROR_UNREADABLE, MAQ_ERROR_IMAGE_SIZE.
 * Blocks while the photo is read. */
MAQ_API maq_status maq_capture_load_view(const maq_capture* capture, uint32_t index, maq_frame** frame);

/* ---- Building ------------------------------------------------------------------------------------------------------ */

/* Called on the thread that builds: how much of the call is done, 0 to 1, and what is being done, a sentence that is valid
 * during the call. Returning 0 cancels, anything else goes on. It must not call the builder that calls it, nor throw. */
typedef int32_t (*maq_scene_progress_callback)(void* user_data, double done, const char* what);

typedef struct maq_scene_build_config {
  uint32_t struct_size;
  int32_t threads;          /* 0 (default): the machine's cores, at most 4 */
  const char* bundle_path;  /* folder of the scene networks; required. Copied. */
  int32_t long_side_px;     /* larger photos are made smaller before they are looked at; default 640; 0: never */
  int32_t coefficient_bits; /* of the scene's looks: 8 (default), 16, or 32 for floats, places then too */
  /* Points whose look varies less between the photos keep their mean alone, which makes the file smaller; in units of
   * colours of 0 to 1. 0 keeps all; negative (default): the library's choice, 0.05, and where numbers have 8 bits so much
   * more that half of the points vary at most. */
  double min_variation;
  /* Of a photo's sides, for finding which points it sees: below 1 a point hides more of what is behind it, for sparse
   * clouds. 1/16 to 1 (default). */
  double visibility_scale;
  double near_depth; /* points nearer to a camera, along its axis, are not seen by it; units of the scene, default 0 */
  uint64_t max_points; /* of larger clouds points are taken evenly; 0 (default): all */
  /* For what is known of points while building: 4 bytes for each of the cloud and 336 more for each that a photo has seen.
   * 0 (default): 2 GiB. The cloud itself (12 bytes a point), photos and networks come on top. */
  uint64_t max_memory_bytes;
  maq_scene_progress_callback
      progress_callback; /* of maq_scene_build and of each maq_scene_builder_add_view; may be NULL */
  void* progress_user_data;
  /* Of maq_scene_build alone; a builder takes what it is given: */
  uint32_t max_views;   /* of more photos some are taken evenly; 0 (default): all */
  int32_t use_held_out; /* 1: photos that the capture keeps for comparisons too; default 0 */
} maq_scene_build_config;

typedef struct maq_scene_build_stats {
  uint32_t struct_size;
  uint32_t view_count; /* photos that saw points */
  uint32_t
      unused_view_count; /* photos that saw none; of maq_scene_build also those that are missing, damaged or too large */
  uint64_t cloud_point_count; /* after max_points */
  uint64_t seen_point_count;  /* that a photo has seen */
  /* Wall-clock milliseconds so far, over all photos: reading and undistorting them, finding which points they see, turning
   * them upright, the network, what is done point by point; then solving for the looks, and packing the scene. */
  double load_ms, visibility_ms, align_ms, extract_ms, accumulate_ms, solve_ms, pack_ms;
} maq_scene_build_stats;

/* Fills `config` with the defaults and sets struct_size. `struct_size` is sizeof(maq_scene_build_config) of the caller.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_scene_build_config_init(maq_scene_build_config* config, uint32_t struct_size);

/* Makes a scene of a capture. Photos that cannot be read are left out and counted, points that no photo saw too. `stats`
 * may be NULL; else the caller sets stats->struct_size. `*scene` is the caller's, to be given to maq_scene_close; it needs
 * neither the capture nor its folder any more. On failure and when cancelled `*scene` and `*stats` are as before.
 * Any thread; several scenes may be built at once. Errors: MAQ_ERROR_INVALID_ARGUMENT (also: every photo is held out),
 * MAQ_ERROR_NOT_FOUND, MAQ_ERROR_BAD_BUNDLE and MAQ_ERROR_UNSUPPORTED (the networks; these are none of scenes),
 * MAQ_ERROR_RUNTIME_LIBRARY,
 * MAQ_ERROR_UNREADABLE (no photo can be used or sees a point), MAQ_ERROR_OUT_OF_MEMORY (max_memory_bytes, or the machine's),
 * MAQ_ERROR_INFERENCE, MAQ_CANCELLED (by the progress callback). Blocks until it is done. */
MAQ_API maq_status maq_scene_build(maq_context* context, const maq_scene_build_config* config,
                                   const maq_capture* capture, maq_scene_build_stats* stats, maq_scene** scene);

/* A cloud of the app. The arrays stay the app's and are copied. */
typedef struct maq_point_cloud {
  uint32_t struct_size;
  uint64_t point_count; /* 1 to 30 million */
  const float* xyz;     /* x, y, z of each point, relative to origin */
  double origin[3];     /* in the world; near the cloud where the world's own is far away, since floats have 7 digits */
  double up[3];         /* the world's up; any length but 0 */
} maq_point_cloud;

/* Begins a scene with a cloud of the app. `*builder` is the caller's, to be given to maq_scene_builder_destroy.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT (no points, a point that is not finite, an up that is none),
 * MAQ_ERROR_UNSUPPORTED (over 30 million points; networks that are none of scenes), MAQ_ERROR_NOT_FOUND, MAQ_ERROR_BAD_BUNDLE, MAQ_ERROR_RUNTIME_LIBRARY,
 * MAQ_ERROR_OUT_OF_MEMORY (max_memory_bytes). Blocks while networks are read and the cloud is copied. */
MAQ_API maq_status maq_scene_builder_create(maq_context* context, const maq_scene_build_config* config,
                                            const maq_point_cloud* cloud, maq_scene_builder** builder);

/* Frees what was known of the points (NULL is fine). Scenes made by it stay.
 * Once for each handle, from any thread. Does not block. */
MAQ_API void maq_scene_builder_destroy(maq_scene_builder* builder);

/* Looks at a photo, of any pixel format but depth: which points it sees, and how they look in it. Nothing is kept of the
 * photo: memory does not grow with their number. On failure and when cancelled the builder knows what it knew before.
 * `*seen_points`, unless NULL: how many points this photo saw, which may be none.
 * One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT (a camera that is none, of another size than the photo, or whose
 * distortion folds the picture), MAQ_ERROR_IMAGE_SIZE (too large for the network once it is shrunk to long_side_px),
 * MAQ_ERROR_UNSUPPORTED (a depth image), MAQ_ERROR_OUT_OF_MEMORY (max_memory_bytes, or the machine's), MAQ_ERROR_INFERENCE,
 * MAQ_CANCELLED. Blocks while it looks. */
MAQ_API maq_status maq_scene_builder_add_view(maq_scene_builder* builder, const maq_frame* photo,
                                              const maq_pinhole_camera* camera, uint64_t* seen_points);

/* The maq_scene_builder_add_view that runs, or else the next, ends with MAQ_CANCELLED; those after it go on as usual.
 * Any thread, also while another adds a view. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_scene_builder_cancel(maq_scene_builder* builder);

/* What was added and how long it took. The caller sets stats->struct_size.
 * One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_scene_builder_get_stats(const maq_scene_builder* builder, maq_scene_build_stats* stats);

/* Makes a scene of what is known by now; views can be added afterwards, for another scene. Points that no photo saw are
 * left out. For a moment it takes 244 bytes more for each point that was seen. `*scene` is the caller's, to be given to
 * maq_scene_close.
 * One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT (no photo saw a point), MAQ_ERROR_OUT_OF_MEMORY. Blocks until
 * it is done. */
MAQ_API maq_status maq_scene_builder_finish(maq_scene_builder* builder, maq_scene** scene);

/* ---- Scenes -------------------------------------------------------------------------------------------------------- */

typedef struct maq_scene_info {
  uint32_t struct_size;
  int32_t coefficient_bits; /* 8, 16 or 32 */
  uint64_t point_count;
  uint64_t view_dependent_count; /* of them, whose look depends on the side from which they are seen */
  uint64_t block_count;          /* boxes of neighbouring points, which are left out whole where they are not seen */
  double up[3];                  /* the world's up; unit vector */
  double bounds_min[3], bounds_max[3]; /* the box of all points, in the world */
  uint8_t networks_sha256[32];         /* of the networks that it was made with: the renderer wants the same */
} maq_scene_info;

/* Opens a scene file (.maqs): it is checked whole and mapped, not read into memory. The file must not be written to or cut
 * while the scene is open (it may be deleted or renamed, and maq_scene_save to its name is fine: that makes a new file).
 * `*scene` is the caller's, to be given to maq_scene_close.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT, MAQ_ERROR_NOT_FOUND, MAQ_ERROR_UNREADABLE (cut off, damaged, or no scene),
 * MAQ_ERROR_UNSUPPORTED (of another version), MAQ_ERROR_OUT_OF_MEMORY. Blocks while it is checked. */
MAQ_API maq_status maq_scene_open(maq_context* context, const char* path, maq_scene** scene);

/* Writes the scene to a file, whole or not at all: what was there stays until the new one is complete. The folder must be
 * there.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT, MAQ_ERROR_UNWRITABLE. Blocks until the disk has it. */
MAQ_API maq_status maq_scene_save(const maq_scene* scene, const char* path);

/* Writes places and mean colours as binary PLY, for other programs; whole or not at all.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT, MAQ_ERROR_UNWRITABLE. Blocks until the disk has it. */
MAQ_API maq_status maq_scene_save_ply(const maq_scene* scene, const char* path);

/* What the scene is made of. The caller sets info->struct_size.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_scene_get_info(const maq_scene* scene, maq_scene_info* info);

/* Once for each handle, from any thread (NULL is fine). Renderers of it stay usable. Does not block. */
MAQ_API void maq_scene_close(maq_scene* scene);

/* ---- Rendering ----------------------------------------------------------------------------------------------------- */

typedef struct maq_scene_renderer_config {
  uint32_t struct_size;
  int32_t threads;         /* 0 (default): the machine's cores, at most 4 */
  const char* bundle_path; /* folder of the scene networks; required. Copied. */
  double near_depth;     /* points nearer to the camera, along its axis, are not drawn; units of the scene, default 0 */
  uint8_t background[3]; /* red, green, blue; only with use_background */
  int32_t use_background;   /* 1: pictures are drawn over `background` by their alpha; 0 (default): where no points are
                               near they have the mean colour that the photos show there */
  uint32_t image_pool_size; /* images the app may hold at once, 1 to 64; default 4 */
  int32_t allow_spinning; /* 1 (default): idle threads stay awake between two steps; 0: they sleep, slower but frugal */
  /* For measuring what is saved: 1 does it all the same. Pictures stay the same where alpha is above 0. */
  int32_t draw_unseen_blocks, refine_empty_parts;
} maq_scene_renderer_config;

/* The planes of an image, each of the camera's size. */
typedef enum maq_scene_plane {
  MAQ_SCENE_PLANE_BGR = 1,   /* three bytes a pixel: blue, green, red */
  MAQ_SCENE_PLANE_ALPHA = 2, /* one byte a pixel: 255 surely covered by points, 0 no point near */
  MAQ_SCENE_PLANE_DEPTH =
      3 /* a float a pixel: of the nearest point, along the optical axis, in units of the scene; 0 where
                          no point is near */
} maq_scene_plane;

/* Times are wall-clock milliseconds. */
typedef struct maq_scene_image_stats {
  uint32_t struct_size;
  float project_ms;  /* points to pixels */
  float shade_ms;    /* looks of what is seen, and coarser rasters */
  float refine_ms;   /* the network */
  float resample_ms; /* back to the camera, colours to bytes */
  float total_ms;
  uint32_t drawn_block_count;  /* the others are outside of the picture */
  uint64_t drawn_point_count;  /* in these blocks */
  uint64_t shaded_point_count; /* that win a pixel */
  int64_t refined_pixel_count; /* that the network saw */
} maq_scene_image_stats;

/* Fills `config` with the defaults and sets struct_size. `struct_size` is sizeof(maq_scene_renderer_config) of the caller.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_scene_renderer_config_init(maq_scene_renderer_config* config, uint32_t struct_size);

/* Makes a renderer of a scene. Several renderers of one scene may run at once; they share its points, not the networks.
 * `*renderer` is the caller's, to be given to maq_scene_renderer_destroy.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT, MAQ_ERROR_NOT_FOUND, MAQ_ERROR_BAD_BUNDLE (also: not the networks that
 * the scene was made with), MAQ_ERROR_RUNTIME_LIBRARY. Blocks while networks are read. */
MAQ_API maq_status maq_scene_renderer_create(maq_context* context, const maq_scene_renderer_config* config,
                                             const maq_scene* scene, maq_scene_renderer** renderer);

/* Once for each handle, from any thread, while it does not render (NULL is fine). Images still held stay valid until they
 * are released. Does not block. */
MAQ_API void maq_scene_renderer_destroy(maq_scene_renderer* renderer);

/* Renders what a camera sees, in a picture of the camera's size. The first picture of a size takes longer: networks are
 * prepared for it. Where nothing is seen no network runs. `*image` comes from a pool of image_pool_size: give it back with
 * maq_scene_image_release.
 * One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT (a camera that is none, or with distortion; a principal point over a
 * million pixels away; focal lengths that differ by a factor over 1000), MAQ_ERROR_IMAGE_SIZE, MAQ_ERROR_POOL_EMPTY,
 * MAQ_ERROR_OUT_OF_MEMORY, MAQ_ERROR_INFERENCE. Blocks while it renders. */
MAQ_API maq_status maq_scene_renderer_run(maq_scene_renderer* renderer, const maq_pinhole_camera* camera,
                                          maq_scene_image** image);

/* Gives the image back (NULL is fine). Pointers into it are invalid afterwards.
 * Once for each image, from any thread. Does not block. */
MAQ_API void maq_scene_image_release(maq_scene_image* image);

/* A plane of the image: rows of `*stride_bytes` bytes, inside the image.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_scene_image_get_plane(const maq_scene_image* image, maq_scene_plane plane, const void** pixels,
                                             size_t* stride_bytes);

/* Times and counts. The caller sets stats->struct_size.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_scene_image_get_stats(const maq_scene_image* image, maq_scene_image_stats* stats);

#ifdef __cplusplus
}
#endif

#endif /* MAQUETTE_SCENE_H_ */
