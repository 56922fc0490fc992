/* Scenes: built from a capture (posed photos and a point cloud), rendered from new viewpoints, without training for
 * each place (NPBG++, arXiv 2203.13318; docs/scenes.md).
 *
 *   maq_capture* capture;          maq_capture_open(context, "folder", &capture);
 *   maq_scene* scene;              maq_scene_build(context, NULL, capture, NULL, &scene);
 *                                  maq_scene_save(scene, "place.maqs");
 *   maq_scene_renderer* renderer;  maq_scene_renderer_create(context, NULL, scene, &renderer);
 *   maq_scene_image* image;        maq_scene_renderer_run(renderer, &camera, &image);
 *                                  maq_scene_image_save(image, "view.png", 0);
 *
 * An app with a point cloud and cameras of its own adds its photos to a maq_scene_builder.
 *
 * Lengths are in the unit of the cloud and the cameras ("units of the scene"). A scene is rendered with the bundle
 * of networks that it was built with. Objects may be destroyed and closed in any order: each keeps what it needs. */
#ifndef MAQUETTE_SCENE_H_
#define MAQUETTE_SCENE_H_

#include "maquette/capture.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct maq_scene maq_scene;
typedef struct maq_scene_builder maq_scene_builder;
typedef struct maq_scene_renderer maq_scene_renderer;
typedef struct maq_scene_image maq_scene_image;

/* ---- Building ---- */

/* Receives the progress of a call on the thread that builds: `done` is its fraction, 0 to 1, `stage` a sentence that is
 * valid during the call. Return 0 to cancel, anything else to go on. It must not call the builder, nor throw. */
typedef int32_t (*maq_scene_progress_callback)(void* user_data, double done, const char* stage);

typedef struct maq_scene_build_config {
  uint32_t struct_size;
  int32_t threads;         /* 0 (default): the machine's large cores, at most 4 */
  const char* bundle_path; /* folder of the scene networks; NULL (default): bundle_files, or without them the bundle
                              installed with the library (share/maquette/models/scenes-int8). Copied. */
  const maq_memory_file* bundle_files; /* the bundle's files in memory, instead of bundle_path; default NULL. Copied. */
  uint32_t bundle_file_count;          /* default 0 */
  int32_t long_side_px;     /* larger photos are scaled down to this long side; default 640; 0: they are not scaled */
  int32_t coefficient_bits; /* of the scene's descriptors: 8 (default), 16, or 32 (floats, positions then too) */
  /* Points whose descriptors vary less than this between photos (RMS, for colours of 0 to 1) are stored without view
   * dependence, which makes the file smaller. 0: all points are view-dependent; negative (default): 0.05, and with 8
   * bits a larger value if needed, so that at most half of the points are view-dependent. */
  double min_variation;
  /* Fraction of a photo's resolution at which visibility is tested, 1/16 to 1 (default). With a smaller fraction, each
   * point hides more of what is behind it; use it for sparse clouds. */
  double visibility_scale;
  double near_depth; /* points nearer to a camera, along its axis, are not seen by it; units of the scene, default 0 */
  uint64_t max_points; /* larger clouds are thinned out evenly; 0 (default): no limit */
  /* Memory for the fitting of descriptors: 4 bytes for each point of the cloud and 336 more for each that a photo has
   * seen. 0 (default): 2 GiB. The cloud itself (12 bytes a point), photos and networks come on top. */
  uint64_t max_memory_bytes;
  maq_scene_progress_callback progress_callback; /* of maq_scene_build and maq_scene_builder_add_view; may be NULL */
  void* progress_user_data;                      /* passed to progress_callback */
  /* For maq_scene_build; a builder takes the photos that it is given: */
  uint32_t max_views;   /* if there are more photos, an even selection is used; 0 (default): no limit */
  int32_t use_held_out; /* 1: also photos that the capture holds out for comparisons; default 0 */
} maq_scene_build_config;

typedef struct maq_scene_build_stats {
  uint32_t struct_size;
  uint32_t view_count;        /* photos that saw points */
  uint32_t unused_view_count; /* photos that saw none; for maq_scene_build also those missing, damaged or too large */
  uint64_t cloud_point_count; /* after max_points */
  uint64_t seen_point_count;  /* points that a photo has seen */
  /* Wall-clock milliseconds so far, over all photos: reading and undistorting, finding visible points, aligning with
   * gravity, the extractor network, accumulating the regression; then solving it, and packing the scene. */
  double load_ms, visibility_ms, align_ms, extract_ms, accumulate_ms, solve_ms, pack_ms;
} maq_scene_build_stats;

/* Fills `config` with the defaults and sets struct_size. `struct_size` is sizeof(maq_scene_build_config) of the caller.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_scene_build_config_init(maq_scene_build_config* config, uint32_t struct_size);

/* Builds a scene from a capture. Photos that cannot be read are dropped and counted; points that no photo saw are
 * dropped. `config` may be NULL for the defaults. `stats` may be NULL; else the caller sets stats->struct_size.
 * `*scene` is the caller's, to be given to maq_scene_close; it needs neither the capture nor its folder. On failure and
 * when cancelled `*scene` and `*stats` stay unchanged.
 * Any thread; several scenes may be built at once. Errors: MAQ_ERROR_INVALID_ARGUMENT (also: every photo is held out),
 * MAQ_ERROR_NOT_FOUND, MAQ_ERROR_BAD_BUNDLE and MAQ_ERROR_UNSUPPORTED (the bundle; it is for another task),
 * MAQ_ERROR_RUNTIME_LIBRARY, MAQ_ERROR_UNREADABLE (no photo can be used or sees a point), MAQ_ERROR_OUT_OF_MEMORY
 * (max_memory_bytes, or the machine's memory), MAQ_ERROR_INFERENCE, MAQ_CANCELLED (by the progress callback). Blocks
 * until it is done. */
MAQ_API maq_status maq_scene_build(maq_context* context, const maq_scene_build_config* config,
                                   const maq_capture* capture, maq_scene_build_stats* stats, maq_scene** scene);

/* A point cloud of the app. The array stays the app's and is copied. */
typedef struct maq_point_cloud {
  uint32_t struct_size;
  uint64_t point_count; /* 1 to 30 million */
  const float* xyz;     /* x, y, z of each point, relative to origin */
  double origin[3];     /* in the world; near the cloud, since floats have 7 digits */
  double up[3];         /* of the world; any length but 0 */
} maq_point_cloud;

/* Creates a builder for a cloud of the app. `config` may be NULL for the defaults. `*builder` is the caller's, to be
 * given to maq_scene_builder_destroy.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT (no points, a point that is not finite, `up` without length),
 * MAQ_ERROR_UNSUPPORTED (over 30 million points; a bundle for another task), MAQ_ERROR_NOT_FOUND,
 * MAQ_ERROR_BAD_BUNDLE, MAQ_ERROR_RUNTIME_LIBRARY, MAQ_ERROR_OUT_OF_MEMORY (max_memory_bytes). Blocks while networks
 * are read and the cloud is copied. */
MAQ_API maq_status maq_scene_builder_create(maq_context* context, const maq_scene_build_config* config,
                                            const maq_point_cloud* cloud, maq_scene_builder** builder);

/* Frees the builder (NULL is fine). Scenes that it finished stay valid.
 * Once for each builder, from any thread. Does not block. */
MAQ_API void maq_scene_builder_destroy(maq_scene_builder* builder);

/* Adds a photo, of any pixel format but depth: finds the points it sees and accumulates their features. The photo is
 * not kept: memory does not grow with the number of photos. On failure and when cancelled the builder stays as it
 * was. `*seen_point_count`, unless NULL: how many points this photo saw, possibly 0.
 * One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT (an invalid camera, one of another size than the photo, or with
 * a distortion that is not invertible within the photo), MAQ_ERROR_IMAGE_SIZE (too large for the network after
 * scaling to long_side_px), MAQ_ERROR_UNSUPPORTED (a depth image), MAQ_ERROR_OUT_OF_MEMORY (max_memory_bytes, or the
 * machine's memory), MAQ_ERROR_INFERENCE, MAQ_CANCELLED. Blocks until the photo has been added. */
MAQ_API maq_status maq_scene_builder_add_view(maq_scene_builder* builder, const maq_frame* photo,
                                              const maq_pinhole_camera* camera, uint64_t* seen_point_count);

/* Cancels the maq_scene_builder_add_view that runs, or else the next: it returns MAQ_CANCELLED. Later ones run as
 * usual.
 * Any thread, also while another adds a view. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_scene_builder_cancel(maq_scene_builder* builder);

/* Gets counts and times so far. The caller sets stats->struct_size.
 * One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_scene_builder_get_stats(const maq_scene_builder* builder, maq_scene_build_stats* stats);

/* Builds a scene from the photos so far; more can be added afterwards, for another scene. Points that no photo saw are
 * dropped. Takes 244 bytes more for each seen point until it returns. `*scene` is the caller's, to be given to
 * maq_scene_close.
 * One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT (no photo saw a point), MAQ_ERROR_OUT_OF_MEMORY. Blocks until it is
 * done. */
MAQ_API maq_status maq_scene_builder_finish(maq_scene_builder* builder, maq_scene** scene);

/* ---- Scenes ---- */

typedef struct maq_scene_info {
  uint32_t struct_size;
  int32_t coefficient_bits; /* 8, 16 or 32 */
  uint64_t point_count;
  uint64_t view_dependent_count;       /* points whose descriptors depend on the viewing direction */
  uint64_t block_count;                /* boxes of neighbouring points, the units of frustum culling */
  double up[3];                        /* of the world; unit vector */
  double bounds_min[3], bounds_max[3]; /* of the points, in the world */
  uint8_t networks_sha256[32];         /* of the networks that built it; a renderer needs the same */
} maq_scene_info;

/* Opens a scene file (.maqs): checks it completely and maps it into memory. While the scene is open the file must
 * not be written to or truncated; it may be deleted or renamed, and maq_scene_save to its name is fine (it makes a
 * new file). `*scene` is the caller's, to be given to maq_scene_close.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT, MAQ_ERROR_NOT_FOUND, MAQ_ERROR_UNREADABLE (truncated, damaged, or
 * not a scene), MAQ_ERROR_UNSUPPORTED (another version), MAQ_ERROR_OUT_OF_MEMORY. Blocks while it is checked. */
MAQ_API maq_status maq_scene_open(maq_context* context, const char* path, maq_scene** scene);

/* Opens a scene file that lies in memory, of any alignment; it is copied. Otherwise like maq_scene_open. */
MAQ_API maq_status maq_scene_open_memory(maq_context* context, const void* data, size_t size_bytes, maq_scene** scene);

/* Closes the scene (NULL is fine), however it was made. Renderers of it stay usable.
 * Once for each scene, from any thread. Does not block. */
MAQ_API void maq_scene_close(maq_scene* scene);

/* Writes the scene to a file, atomically: an existing file stays until the new one is complete. The folder must exist.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT, MAQ_ERROR_UNWRITABLE. Blocks until the file is on the disk. */
MAQ_API maq_status maq_scene_save(const maq_scene* scene, const char* path);

/* Writes positions and mean colours as a binary PLY file, for other programs; atomically.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT, MAQ_ERROR_UNWRITABLE. Blocks until the file is on the disk. */
MAQ_API maq_status maq_scene_save_ply(const maq_scene* scene, const char* path);

/* Describes the scene. The caller sets info->struct_size.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_scene_get_info(const maq_scene* scene, maq_scene_info* info);

/* ---- Rendering ---- */

typedef struct maq_scene_renderer_config {
  uint32_t struct_size;
  int32_t threads;                     /* 0 (default): the machine's large cores, at most 4 */
  const char* bundle_path;             /* as in maq_scene_build_config; the bundle that built the scene */
  const maq_memory_file* bundle_files; /* as in maq_scene_build_config */
  uint32_t bundle_file_count;
  int32_t use_background; /* 1: pictures are composed over `background` by their alpha; 0 (default): where no points are
                               near they get the mean colour that the photos show there */
  double near_depth;     /* points nearer to the camera, along its axis, are not drawn; units of the scene, default 0 */
  uint8_t background[3]; /* red, green, blue; with use_background */
  uint32_t image_pool_size; /* images the app may hold at once, 1 to 64; default 4 */
  int32_t allow_spinning;   /* 1 (default): idle threads spin for a while; 0: they sleep, which saves energy and costs
                               some speed */
  /* To measure what an optimisation saves; pictures stay the same where alpha is above 0. Default 0: */
  int32_t draw_unseen_blocks; /* 1: no frustum culling */
  int32_t refine_empty_parts; /* 1: the network also runs where there are no points */
  maq_provider provider;      /* for the network, as in maq_densepose_config; default MAQ_PROVIDER_CPU */
} maq_scene_renderer_config;

/* The planes of an image, each of the camera's size. */
typedef enum maq_scene_plane {
  MAQ_SCENE_PLANE_BGR = 1,   /* three bytes a pixel: blue, green, red */
  MAQ_SCENE_PLANE_ALPHA = 2, /* one byte a pixel: coverage by points, 0 (none near) to 255 */
  MAQ_SCENE_PLANE_DEPTH = 3  /* a float a pixel: depth of the nearest point along the optical axis, in units of the
                                scene; 0 where no point is near */
} maq_scene_plane;

/* Times in wall-clock milliseconds, and counts. */
typedef struct maq_scene_image_stats {
  uint32_t struct_size;
  float project_ms;  /* points to pixels */
  float shade_ms;    /* descriptors of the visible points, and coarser rasters */
  float refine_ms;   /* the network */
  float resample_ms; /* back to the camera's roll, colours to bytes */
  float total_ms;
  uint32_t drawn_block_count;  /* blocks within the view frustum */
  uint64_t drawn_point_count;  /* in these blocks */
  uint64_t shaded_point_count; /* front-most at some pixel */
  int64_t refined_pixel_count; /* that the network computed */
  maq_provider provider;       /* in use for the network; MAQ_PROVIDER_CPU where it did not run */
} maq_scene_image_stats;

/* Fills `config` with the defaults and sets struct_size. `struct_size` is sizeof(maq_scene_renderer_config) of the
 * caller. Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_scene_renderer_config_init(maq_scene_renderer_config* config, uint32_t struct_size);

/* Creates a renderer of a scene. Several renderers of one scene may run at once; they share its points, not the
 * networks. `config` may be NULL for the defaults. `*renderer` is the caller's, to be given to
 * maq_scene_renderer_destroy.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT, MAQ_ERROR_NOT_FOUND, MAQ_ERROR_BAD_BUNDLE (also: the scene was
 * built with other networks), MAQ_ERROR_RUNTIME_LIBRARY. Blocks while networks are read. */
MAQ_API maq_status maq_scene_renderer_create(maq_context* context, const maq_scene_renderer_config* config,
                                             const maq_scene* scene, maq_scene_renderer** renderer);

/* Frees the renderer (NULL is fine). Images still held stay valid until they are released.
 * Once for each renderer, from any thread, while it does not render. Does not block. */
MAQ_API void maq_scene_renderer_destroy(maq_scene_renderer* renderer);

/* Renders the view of a camera, in a picture of the camera's size. The first picture of a size takes longer, since
 * networks are prepared for it. If no point is visible, no network runs. `*image` comes from a pool of
 * image_pool_size: give it back with maq_scene_image_release.
 * One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT (an invalid camera, or one with distortion; a principal point
 * over a million pixels away; focal lengths that differ by a factor over 1000), MAQ_ERROR_IMAGE_SIZE,
 * MAQ_ERROR_POOL_EMPTY, MAQ_ERROR_OUT_OF_MEMORY, MAQ_ERROR_INFERENCE. Blocks while it renders. */
MAQ_API maq_status maq_scene_renderer_run(maq_scene_renderer* renderer, const maq_pinhole_camera* camera,
                                          maq_scene_image** image);

/* Gives the image back (NULL is fine). Pointers into it are invalid afterwards.
 * Once for each image, from any thread. Does not block. */
MAQ_API void maq_scene_image_release(maq_scene_image* image);

/* Gets a plane: rows of `*stride_bytes` bytes, inside the image.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_scene_image_get_plane(const maq_scene_image* image, maq_scene_plane plane, const void** pixels,
                                             size_t* stride_bytes);

/* Gets times and counts. The caller sets stats->struct_size.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_scene_image_get_stats(const maq_scene_image* image, maq_scene_image_stats* stats);

/* Writes the image to a file, in the format of the path's extension: PNG (.png), lossless, with alpha where
 * `with_alpha` is 1, or JPEG (.jpg, .jpeg) at quality 95, without alpha. The file is written atomically and replaces
 * an existing one; its folder must exist.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT (another extension, alpha in a JPEG file), MAQ_ERROR_UNWRITABLE,
 * MAQ_ERROR_RUNTIME_LIBRARY (libmaquette_files.so is missing). Blocks while it is written. */
MAQ_API maq_status maq_scene_image_save(const maq_scene_image* image, const char* path, int32_t with_alpha);

#ifdef __cplusplus
}
#endif

#endif /* MAQUETTE_SCENE_H_ */
