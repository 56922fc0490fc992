/* Scenes: built from a capture (posed photos and a point cloud), rendered from new viewpoints. No network is trained
 * for an environment (NPBG++, arXiv 2203.13318; docs/guide/scene.md).
 *
 *   maq_capture* capture;          maq_capture_open(context, "folder", &capture);
 *   maq_scene* scene;              maq_scene_build(context, NULL, capture, &scene);
 *                                  maq_scene_save(scene, "room.maqs");
 *   maq_scene_renderer* renderer;  maq_scene_renderer_create(context, NULL, scene, &renderer);
 *   maq_image* image;              maq_scene_renderer_run(renderer, &camera, &image);
 *                                  maq_image_save(image, "view.png", MAQ_IMAGE_ALPHA_OFF);
 *
 * An app with its own point cloud and cameras adds its photos to a maq_scene_builder.
 *
 * maq_scene_open also reads 3D Gaussians ("splats") of other programs, and the renderer draws them on the CPU.
 *
 * Lengths are in the unit of the cloud and the cameras ("units of the scene"). A scene of points is rendered with the
 * bundle that built it; splats need none. Objects may be destroyed in any order. */
#ifndef MAQUETTE_SCENE_H_
#define MAQUETTE_SCENE_H_

#include "maquette/capture.h"
#include "maquette/image.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct maq_scene maq_scene;
typedef struct maq_scene_builder maq_scene_builder;
typedef struct maq_scene_renderer maq_scene_renderer;

/* ---- Building ---- */

/* For maq_scene_build_config.long_side_px: photos are not scaled. */
#define MAQ_SCENE_LONG_SIDE_FULL (-1)

/* For maq_scene_build_config.min_variation: all points are view-dependent. */
#define MAQ_SCENE_VARIATION_ALL (-1)

/* Where the points of maq_scene_build come from. Values never change meaning; new ones are added at the end. */
typedef enum maq_scene_points {
  MAQ_SCENE_POINTS_DEFAULT = 0, /* MAQ_SCENE_POINTS_DEPTH if the capture's cloud is sparse: it is COLMAP's own points or
                                   nerfstudio's sparse_pc.ply. Otherwise MAQ_SCENE_POINTS_CLOUD. */
  MAQ_SCENE_POINTS_CLOUD = 1,   /* the capture's cloud */
  MAQ_SCENE_POINTS_DEPTH = 2    /* depth is computed for each photo and fused into a dense cloud (dense_cloud.h). The
                                   capture's cloud is used if that gives fewer points. */
} maq_scene_points;

/* All zero is the default. */
typedef struct maq_scene_build_config {
  uint32_t struct_size;
  maq_model_options model; /* the networks. The bundle has the task "scenes"; the installed one is
                              share/maquette/models/scenes-int8. MAQ_THREADS_MEASURED is not supported. */
  int32_t long_side_px; /* larger photos are scaled down to this long side. 0: 640; MAQ_SCENE_LONG_SIDE_FULL: never */
  int32_t coefficient_bits; /* size of a descriptor's numbers: 8, 16, or 32 (floats, then also positions). 0: 8 */
  /* Points with descriptors that vary less than this between photos are stored without view dependence. Unit: RMS,
   * for colours of 0 to 1; a larger value makes a smaller file. 0: 0.05, or with 8 bits the value at which half of the
   * points are view-dependent, if that is larger. MAQ_SCENE_VARIATION_ALL: all points are view-dependent. */
  double min_variation;
  /* Fraction of a photo's resolution at which visibility is tested, 1/16 to 1. A smaller fraction lets each point hide
   * more of the points behind it; use it for sparse clouds. 0: 1 */
  double visibility_scale;
  double near_depth;   /* a camera does not see points nearer than this along its axis; units of the scene. 0: all */
  uint64_t max_points; /* larger clouds are thinned out evenly. 0: no limit */
  /* Memory for the descriptors: 4 bytes for each point of the cloud and 336 bytes more for each point that a photo has
   * seen. The cloud itself (12 bytes a point), photos and networks come on top. 0: 2 GiB */
  uint64_t max_memory_bytes;
  maq_progress_callback progress_callback; /* of maq_scene_build and maq_scene_builder_add_view; may be NULL */
  void* progress_user_data;                /* passed to progress_callback */
  /* For maq_scene_build only: */
  uint32_t max_views;      /* if there are more photos, an even selection is used. 0: no limit */
  int32_t use_held_out;    /* 1: also use photos that the capture holds out for comparison; 0: do not */
  maq_scene_points points; /* with MAQ_SCENE_POINTS_DEPTH, max_points 0 means 1.5 million */
  /* Above 0: the scene is of splats, one for each point, which are fitted to the photos for so many seconds of
   * wall-clock time. Save it to a .ply, .spz or .glb file. 0: points. At most 86400 */
  double splat_fit_s;
} maq_scene_build_config;

typedef struct maq_scene_build_stats {
  uint32_t struct_size;
  uint32_t view_count; /* photos that saw points */
  uint32_t
      unused_view_count; /* photos that saw no point; for maq_scene_build also missing, damaged or too large ones */
  uint64_t cloud_point_count; /* after max_points */
  uint64_t seen_point_count;  /* points that a photo has seen */
  /* Wall-clock milliseconds, summed over all photos. */
  double load_ms;       /* reading and undistorting photos */
  double visibility_ms; /* finding visible points */
  double align_ms;      /* aligning photos with gravity */
  double extract_ms;    /* the extractor network */
  double accumulate_ms; /* accumulating the regression */
  double solve_ms;      /* solving the regression */
  double pack_ms;       /* packing the scene */
  double depth_ms;      /* computing and fusing depth; 0 with MAQ_SCENE_POINTS_CLOUD */
} maq_scene_build_stats;

/* Fills `config` with the defaults and sets struct_size. `struct_size` is sizeof(maq_scene_build_config) of the caller.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_scene_build_config_init(maq_scene_build_config* config, uint32_t struct_size);

/* Builds a scene from a capture, of a dense cloud or, if it has only a sparse one, of depth that is computed.
 * Unreadable photos are dropped and counted (maq_scene_get_build_stats); points that no photo saw are dropped. `config`
 * may be NULL for the defaults. The caller owns `*scene`; give it to maq_scene_destroy. The scene needs neither the
 * capture nor its folder. On failure and when cancelled `*scene` stays unchanged. Any thread; several scenes may be
 * built at once. Errors: MAQ_ERROR_INVALID_ARGUMENT (also: every photo is held out). MAQ_ERROR_NOT_FOUND.
 * MAQ_ERROR_BAD_BUNDLE. MAQ_ERROR_UNSUPPORTED (a bundle of another task). MAQ_ERROR_RUNTIME_LIBRARY.
 * MAQ_ERROR_UNREADABLE (no photo is usable or sees a point). MAQ_ERROR_OUT_OF_MEMORY (over max_memory_bytes, or over
 * the machine's memory). MAQ_ERROR_INFERENCE. MAQ_CANCELLED (by the progress callback). Blocks until the scene is
 * built. */
MAQ_API maq_status maq_scene_build(maq_context* context, const maq_scene_build_config* config,
                                   const maq_capture* capture, maq_scene** scene);

/* A point cloud of the app. The array stays the app's and is copied. */
typedef struct maq_point_cloud {
  uint32_t struct_size;
  uint64_t point_count; /* 1 to 30 million */
  const float* xyz;     /* [point_count][3], relative to origin */
  double origin[3];     /* in the world; near the cloud, because floats have 7 digits */
  double up[3];         /* of the world; any length but 0 */
} maq_point_cloud;

/* Creates a builder for a cloud of the app. `config` may be NULL for the defaults. The caller owns `*builder`; give it
 * to maq_scene_builder_destroy.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT (no points, a point that is not finite, `up` without length).
 * MAQ_ERROR_UNSUPPORTED (over 30 million points, a bundle of another task). MAQ_ERROR_NOT_FOUND. MAQ_ERROR_BAD_BUNDLE.
 * MAQ_ERROR_RUNTIME_LIBRARY. MAQ_ERROR_OUT_OF_MEMORY (over max_memory_bytes). Blocks while networks are read and the
 * cloud is copied. */
MAQ_API maq_status maq_scene_builder_create(maq_context* context, const maq_scene_build_config* config,
                                            const maq_point_cloud* cloud, maq_scene_builder** builder);

/* Frees the builder (NULL is fine). Finished scenes stay valid.
 * Once for each builder, from any thread. Does not block. */
MAQ_API void maq_scene_builder_destroy(maq_scene_builder* builder);

/* Adds a photo of any pixel format but depth: finds its visible points and accumulates their features. The photo is not
 * kept: memory does not grow with the number of photos. On failure and when cancelled the builder stays as it was.
 * `*seen_point_count`, unless NULL, is set to the number of points that this photo saw, possibly 0.
 * One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT (an invalid camera, another size than the photo's, a distortion
 * that is not invertible within the photo). MAQ_ERROR_IMAGE_SIZE (too large for the network after scaling to
 * long_side_px). MAQ_ERROR_UNSUPPORTED (a depth image). MAQ_ERROR_OUT_OF_MEMORY (over max_memory_bytes, or over the
 * machine's memory). MAQ_ERROR_INFERENCE. MAQ_CANCELLED. Blocks until the photo has been added. */
MAQ_API maq_status maq_scene_builder_add_view(maq_scene_builder* builder, const maq_frame* photo,
                                              const maq_pinhole_camera* camera, uint64_t* seen_point_count);

/* Cancels the running maq_scene_builder_add_view, or else the next one: it returns MAQ_CANCELLED. Later calls run as
 * usual.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_scene_builder_cancel(maq_scene_builder* builder);

/* Gets counts and times so far. The caller sets stats->struct_size.
 * One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_scene_builder_get_stats(const maq_scene_builder* builder, maq_scene_build_stats* stats);

/* Builds a scene from the photos so far. More photos can be added afterwards, for another scene. Points that no photo
 * saw are dropped. Takes 244 bytes more for each seen point until it returns. The caller owns `*scene`; give it to
 * maq_scene_destroy.
 * One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT (no photo saw a point), MAQ_ERROR_OUT_OF_MEMORY. Blocks until the
 * scene is built. */
MAQ_API maq_status maq_scene_builder_finish(maq_scene_builder* builder, maq_scene** scene);

/* ---- Scenes ---- */

typedef struct maq_scene_info {
  uint32_t struct_size;
  int32_t coefficient_bits;            /* 8, 16 or 32 */
  uint64_t point_count;                /* or splats */
  uint64_t view_dependent_count;       /* points with descriptors that depend on the viewing direction */
  uint64_t block_count;                /* boxes of neighbouring points, the units of frustum culling; splats: 0 */
  double up[3];                        /* of the world; unit vector. Splats: (0, -1, 0), because files do not have it */
  double bounds_min[3], bounds_max[3]; /* of the points, in the world */
  uint8_t networks_sha256[32];         /* of the networks that built it, which a renderer needs; splats: zeros */
} maq_scene_info;

/* Opens a scene file (.maqs): checks all of it and maps it into memory. While the scene is open the file must not be
 * written to or truncated. It may be deleted or renamed, and maq_scene_save may replace it.
 * Also reads splats, into memory: .ply files of 3D Gaussian Splatting, and .spz files of versions 2 and 3. The file's
 * first bytes tell its kind. Splats with numbers that are not finite are left out.
 * The caller owns `*scene`; give it to maq_scene_destroy.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT, MAQ_ERROR_NOT_FOUND, MAQ_ERROR_UNREADABLE (truncated, damaged, not
 * a scene, or without splats), MAQ_ERROR_UNSUPPORTED (another version, a .ply file of points, over 30 million splats),
 * MAQ_ERROR_OUT_OF_MEMORY. Blocks while the file is checked. */
MAQ_API maq_status maq_scene_open(maq_context* context, const char* path, maq_scene** scene);

/* Opens a scene file (.maqs) in memory, of any alignment; it is copied. Otherwise like maq_scene_open. */
MAQ_API maq_status maq_scene_open_memory(maq_context* context, const void* data, size_t size_bytes, maq_scene** scene);

/* Frees the scene (NULL is fine). Its renderers stay usable.
 * Once for each scene, from any thread. Does not block. */
MAQ_API void maq_scene_destroy(maq_scene* scene);

/* Writes the scene to a file, atomically: an existing file stays until the new one is complete. The folder must exist.
 * The extension tells the kind of file. A .ply, .spz or .glb file has splats for other programs: 3D Gaussian Splatting,
 * SPZ version 3, glTF with KHR_gaussian_splatting. Points become flat splats without view dependence. Every other
 * extension is a scene file (.maqs).
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT, MAQ_ERROR_UNWRITABLE, MAQ_ERROR_UNSUPPORTED (splats to a scene file,
 * coordinates over 8 million to an .spz file), MAQ_ERROR_OUT_OF_MEMORY. Blocks until the file is on the disk. */
MAQ_API maq_status maq_scene_save(const maq_scene* scene, const char* path);

/* Writes positions and mean colours as a binary PLY file, for other programs; atomically.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT, MAQ_ERROR_UNWRITABLE, MAQ_ERROR_UNSUPPORTED (splats). Blocks until
 * the file is on the disk. */
MAQ_API maq_status maq_scene_save_ply(const maq_scene* scene, const char* path);

/* Describes the scene. The caller sets info->struct_size.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_scene_get_info(const maq_scene* scene, maq_scene_info* info);

/* Gets counts and times of the build. The caller sets stats->struct_size.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT, MAQ_ERROR_NOT_FOUND (the scene was opened from a file, which has no
 * stats). Does not block. */
MAQ_API maq_status maq_scene_get_build_stats(const maq_scene* scene, maq_scene_build_stats* stats);

/* ---- Rendering ---- */

/* All zero is the default. */
typedef struct maq_scene_renderer_config {
  uint32_t struct_size;
  maq_model_options model; /* the network: the bundle that built the scene. MAQ_THREADS_MEASURED is not supported. For
                              splats the bundle is not read. */
  double near_depth;       /* points nearer to the camera along its axis are not drawn; units of the scene. Splats also
                              not if they reach behind the camera: if their standard deviation is above their depth. */
  int32_t use_background;  /* 1: images are composed over `background` by their alpha. 0: pixels without points have the
                              mean colour of the photos where they show no point; splats are composed over black. */
  uint8_t background[3];   /* red, green, blue; with use_background */
  uint32_t image_pool_size; /* images the app may hold at once, 1 to 64. 0: 4 */
} maq_scene_renderer_config;

/* Times in wall-clock milliseconds, and counts, of one image. */
typedef struct maq_scene_render_stats {
  uint32_t struct_size;
  float project_ms;  /* points to pixels; splats: also sorting */
  float shade_ms;    /* descriptors of the visible points, and coarser rasters; blending of splats */
  float refine_ms;   /* the network */
  float resample_ms; /* back to the camera's roll, colours to bytes */
  float total_ms;
  uint32_t drawn_block_count;  /* blocks within the view frustum */
  uint64_t drawn_point_count;  /* points of these blocks */
  uint64_t shaded_point_count; /* points that are front-most at some pixel; splats within the image */
  int64_t refined_pixel_count; /* pixels that the network computed */
  maq_provider provider;       /* in use for the network; MAQ_PROVIDER_CPU if it did not run */
} maq_scene_render_stats;

/* Fills `config` with the defaults and sets struct_size. `struct_size` is sizeof(maq_scene_renderer_config) of the
 * caller. Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_scene_renderer_config_init(maq_scene_renderer_config* config, uint32_t struct_size);

/* Creates a renderer of a scene. Several renderers of one scene may run at once. They share its points, not the
 * networks; a renderer of splats has a copy of these. `config` may be NULL for the defaults. The caller owns
 * `*renderer`; give it to maq_scene_renderer_destroy.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT, MAQ_ERROR_NOT_FOUND, MAQ_ERROR_BAD_BUNDLE (also: other networks
 * built the scene), MAQ_ERROR_RUNTIME_LIBRARY. Blocks while networks are read. */
MAQ_API maq_status maq_scene_renderer_create(maq_context* context, const maq_scene_renderer_config* config,
                                             const maq_scene* scene, maq_scene_renderer** renderer);

/* Frees the renderer (NULL is fine). Images still held stay valid until they are released.
 * Once for each renderer, from any thread, while it does not render. Does not block. */
MAQ_API void maq_scene_renderer_destroy(maq_scene_renderer* renderer);

/* Renders the view of a camera, in the camera's size. The first image of a size takes longer, because networks are
 * prepared for it. If no point is visible, no network runs. Splats are sorted by depth and blended from front to back.
 * Their alpha is opacity; their depth is the mean of the splats that a pixel shows. `*image` comes from a pool of
 * image_pool_size: give it back with maq_image_release. It has the planes BGR, ALPHA and DEPTH.
 * One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT (an invalid camera, one with distortion, a principal point over a
 * million pixels away, focal lengths that differ by a factor over 1000). MAQ_ERROR_IMAGE_SIZE. MAQ_ERROR_POOL_EMPTY.
 * MAQ_ERROR_OUT_OF_MEMORY. MAQ_ERROR_INFERENCE. Blocks while it renders. */
MAQ_API maq_status maq_scene_renderer_run(maq_scene_renderer* renderer, const maq_pinhole_camera* camera,
                                          maq_image** image);

/* Gets times and counts of an image of maq_scene_renderer_run. The caller sets stats->struct_size.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT (also: an image of a head). Does not block. */
MAQ_API maq_status maq_image_get_scene_stats(const maq_image* image, maq_scene_render_stats* stats);

#ifdef __cplusplus
}
#endif

#endif /* MAQUETTE_SCENE_H_ */
