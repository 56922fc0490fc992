/* Fusion: sharp edges of several views with known cameras in one model. It gives points with their distance to the
 * nearest sharp curve, and curves in the world. An edge that one view hides may be visible in another.
 *
 *   maq_edges_fusion_create(context, NULL, &fusion);
 *   for each view:  maq_edges_run(edges, depth, &result);
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

/* Points and cameras are in world coordinates, in metres like depth. */

typedef struct maq_edges_fusion maq_edges_fusion;

/* Receives the progress of maq_edges_fusion_finish on its thread. `done` is the fraction, 0 to 1. Return 0 to cancel,
 * anything else to continue. It must not call the fusion, and must not throw. */
typedef int32_t (*maq_edges_fusion_progress_callback)(void* user_data, double done);

typedef struct maq_edges_fusion_config {
  uint32_t struct_size;
  int32_t threads;     /* 1 to 64; 0 (default): the machine's large cores, at most 4 */
  double cell_m;       /* approximate distance between points; 0 (default): the footprint of the median pixel */
  uint64_t max_points; /* limit for points, about 240 bytes each at the peak; 0 (default): 4,000,000 */
  int32_t min_views;   /* with three or more views, drop curves that fewer views have seen, 1 to 1000; 0 (default): 2 */
  maq_edges_fusion_progress_callback progress_callback; /* may be NULL */
  void* progress_user_data;                             /* passed to progress_callback */
} maq_edges_fusion_config;

typedef struct maq_edges_fusion_info {
  uint32_t struct_size;
  uint32_t view_count;
  uint32_t empty_view_count; /* views without known depth, included in view_count */
  /* The rest describes the latest maq_edges_fusion_finish; it is 0 before. */
  uint64_t point_count;
  uint64_t outside_pixel_count; /* dropped: more than a million cells from the cameras */
  uint64_t thin_point_count;    /* dropped: surfaces thinner than one cell */
  double cell_m;
  float eps_r;     /* the largest distance of a point is eps_r * r_m */
  float fusion_ms; /* wall-clock time */
} maq_edges_fusion_info;

typedef struct maq_edges_fusion_point {
  double point_m[3];
  float normal[3];     /* length 1, towards the cameras that saw the point */
  float distance_m;    /* to the nearest sharp feature curve that a view sees, at most eps_r * r_m */
  float r_m;           /* the smallest footprint in which a view saw the point */
  uint32_t view_count; /* number of views that saw the point */
} maq_edges_fusion_point;

/* Fills `config` with the defaults and sets struct_size. `struct_size` is sizeof(maq_edges_fusion_config) of the
 * caller. Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_edges_fusion_config_init(maq_edges_fusion_config* config, uint32_t struct_size);

/* Creates a fusion without views. `config` may be NULL for the defaults. The caller owns `*fusion`: free it with
 * maq_edges_fusion_destroy.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_edges_fusion_create(maq_context* context, const maq_edges_fusion_config* config,
                                           maq_edges_fusion** fusion);

/* Frees the fusion (NULL is fine). Curves stay valid until they are released.
 * Once for each fusion, from any thread. Does not block. */
MAQ_API void maq_edges_fusion_destroy(maq_edges_fusion* fusion);

/* Adds the field of a view and finds its curves. `camera` gives the pose. If its intrinsics are all 0, the intrinsics
 * of the result are used. Otherwise they must have the result's size; distortion is ignored. Neither argument is kept.
 * The order of views does not matter. A view without known depth is counted and changes nothing. On failure the fusion
 * stays unchanged.
 * One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT (a camera of another size, an invalid rotation, another eps_r),
 * MAQ_ERROR_UNSUPPORTED (more than 33,554,432 pixels in all views). Blocks for some milliseconds. */
MAQ_API maq_status maq_edges_fusion_add_view(maq_edges_fusion* fusion, const maq_edges_result* result,
                                             const maq_pinhole_camera* camera);

/* Computes points and curves of all views so far, and replaces earlier ones. More views can be added afterwards. After
 * an error or a cancellation there are no points.
 * One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT, MAQ_ERROR_UNSUPPORTED (more than max_points), MAQ_CANCELLED.
 * Blocks until it is done: about one second for 24 views of 320 x 240 pixels. */
MAQ_API maq_status maq_edges_fusion_finish(maq_edges_fusion* fusion);

/* Cancels the running maq_edges_fusion_finish, or else the next one. It returns MAQ_CANCELLED. Later calls are not
 * affected.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_edges_fusion_cancel(maq_edges_fusion* fusion);

/* Gets counts and times. The caller sets info->struct_size.
 * One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_edges_fusion_get_info(const maq_edges_fusion* fusion, maq_edges_fusion_info* info);

/* Writes point_count points to `points`, sorted by position. `count` is the capacity of `points`, in points.
 * One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT (`count` is too small). Does not block. */
MAQ_API maq_status maq_edges_fusion_copy_points(const maq_edges_fusion* fusion, maq_edges_fusion_point* points,
                                                size_t count);

/* Gets the curves of the latest maq_edges_fusion_finish in world coordinates. Read and save them like the curves of a
 * frame. They have no boxes, no adjacent planes, and no pixels to snap to. `*curves` comes from a pool of 4: release it
 * with maq_edges_curves_release.
 * One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT, MAQ_ERROR_POOL_EMPTY. Does not block. */
MAQ_API maq_status maq_edges_fusion_find_curves(const maq_edges_fusion* fusion, maq_edges_curves** curves);

#ifdef __cplusplus
}
#endif

#endif /* MAQUETTE_EDGES_FUSION_H_ */
