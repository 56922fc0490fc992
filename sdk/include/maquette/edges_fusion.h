/* Sharp edges of several views with known cameras as one: points with their distance to the nearest sharp curve, and
 * curves in the world, for what one view hides another shows.
 *
 *   maq_edges_fusion_create(context, NULL, &fusion);
 *   for each view:  maq_edges_run(edges, depth, &camera.intrinsics, &result);
 *                   maq_edges_fusion_add_view(fusion, result, &camera);
 *   maq_edges_fusion_finish(fusion);
 *   maq_edges_fusion_find_curves(fusion, &curves);
 *   maq_edges_curves_save(curves, "model.dxf");
 */
#ifndef MAQUETTE_EDGES_FUSION_H_
#define MAQUETTE_EDGES_FUSION_H_

#include "maquette/edge_curves.h"
#include "maquette/pinhole_camera.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Points and cameras are in the world of the cameras, in metres, since depth is. */

typedef struct maq_edges_fusion maq_edges_fusion;

/* Receives the progress of maq_edges_fusion_finish on its thread: `done` is the fraction, 0 to 1. Return 0 to cancel,
 * anything else to go on. It must not call the fusion, nor throw. */
typedef int32_t (*maq_edges_fusion_progress_callback)(void* user_data, double done);

typedef struct maq_edges_fusion_config {
  uint32_t struct_size;
  int32_t threads;     /* 0 (default): the machine's large cores, at most 4 */
  double cell_m;       /* points are so far from each other, about; 0 (default): the footprint of the median pixel */
  uint64_t max_pixels; /* of all views, which take six bytes each; default 33,554,432 */
  uint64_t max_points; /* which take some 240 bytes each at the peak; default 4,000,000 */
  int32_t min_views;   /* of three views and more, a curve that fewer have seen is left out; 1 to 1000; default 2 */
  maq_edges_fusion_progress_callback progress_callback; /* may be NULL */
  void* progress_user_data;                             /* passed to progress_callback */
} maq_edges_fusion_config;

typedef struct maq_edges_fusion_info {
  uint32_t struct_size;
  uint32_t view_count;
  uint32_t blind_view_count; /* of these, without known depth */
  /* The rest is of the latest maq_edges_fusion_finish, 0 before. */
  uint64_t point_count;
  uint64_t outside_pixel_count; /* left out: a million cells and more from the cameras */
  uint64_t mixed_point_count;   /* left out: both sides of something thinner than a cell */
  double cell_m;
  float eps_r;     /* distances of points are cut off there, times r_m */
  float fusion_ms; /* wall-clock time */
} maq_edges_fusion_info;

typedef struct maq_edges_fusion_point {
  double point_m[3];
  float normal[3];     /* of length 1, towards the cameras that saw it */
  float distance_m;    /* to the nearest sharp feature curve that a view sees, at most eps_r * r_m */
  float r_m;           /* the smallest footprint in which a view saw it */
  uint32_t view_count; /* how many saw it */
} maq_edges_fusion_point;

/* Fills `config` with the defaults and sets struct_size. `struct_size` is sizeof(maq_edges_fusion_config) of the
 * caller. Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_edges_fusion_config_init(maq_edges_fusion_config* config, uint32_t struct_size);

/* Creates a fusion without views. `config` may be NULL for the defaults. `*fusion` is the caller's, to be given to
 * maq_edges_fusion_destroy.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_edges_fusion_create(maq_context* context, const maq_edges_fusion_config* config,
                                           maq_edges_fusion** fusion);

/* Frees the fusion (NULL is fine). Curves still held stay valid until they are released.
 * Once for each fusion, from any thread. Does not block. */
MAQ_API void maq_edges_fusion_destroy(maq_edges_fusion* fusion);

/* Adds the field of a view and finds its curves. `camera` is that of the depth image, whose size it has; its distortion
 * is left out of account. Neither is kept. Views may come in any order. One without known depth counts, and changes
 * nothing. On failure the fusion stays as it was.
 * One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT (a camera of another size or whose rotation is none; a field of
 * another eps_r), MAQ_ERROR_UNSUPPORTED (more than max_pixels). Blocks for some milliseconds. */
MAQ_API maq_status maq_edges_fusion_add_view(maq_edges_fusion* fusion, const maq_edges_result* result,
                                             const maq_pinhole_camera* camera);

/* Makes points and curves of the views so far, in place of those before; more views can be added afterwards. When it
 * fails or is cancelled, there are no points.
 * One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT, MAQ_ERROR_UNSUPPORTED (more than max_points), MAQ_CANCELLED.
 * Blocks until it is done, for a second in some 24 views of 320 x 240 pixels. */
MAQ_API maq_status maq_edges_fusion_finish(maq_edges_fusion* fusion);

/* Cancels the maq_edges_fusion_finish that runs, or else the next: it returns MAQ_CANCELLED. Later ones run as usual.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_edges_fusion_cancel(maq_edges_fusion* fusion);

/* Gets counts. The caller sets info->struct_size.
 * One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_edges_fusion_get_info(const maq_edges_fusion* fusion, maq_edges_fusion_info* info);

/* Writes the points to `points`, point_count of them, in the order of their places; `count` is how many have room
 * there. One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT (too little room). Does not block. */
MAQ_API maq_status maq_edges_fusion_copy_points(const maq_edges_fusion* fusion, maq_edges_fusion_point* points,
                                                size_t count);

/* The curves of the latest maq_edges_fusion_finish, in the world: to be read and saved as those of a frame. They have
 * no boxes and no planes, and no pixels to snap to. `*curves` comes from a pool of 4: give it back with
 * maq_edges_curves_release.
 * One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT, MAQ_ERROR_POOL_EMPTY. Does not block. */
MAQ_API maq_status maq_edges_fusion_find_curves(const maq_edges_fusion* fusion, maq_edges_curves** curves);

#ifdef __cplusplus
}
#endif

#endif /* MAQUETTE_EDGES_FUSION_H_ */
