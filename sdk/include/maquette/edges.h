/* Edges: the distance of each point of a depth frame to the nearest sharp feature curve.
 *
 *   maq_edges_create(context, NULL, &edges);
 *   maq_edges_run(edges, frame, &result);
 *   maq_edges_result_get_plane(result, MAQ_EDGES_PLANE_DISTANCE, &values, &stride_bytes);
 *   maq_edges_result_save(result, "results/box");
 *   maq_edges_result_release(result);
 *
 * edge_curves.h finds lines, arcs and boxes in a result. edges_fusion.h joins several views. */
#ifndef MAQUETTE_EDGES_H_
#define MAQUETTE_EDGES_H_

#include "maquette/source.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Lengths are in pixel footprints: r = depth / focal length. At the depth of a pixel, one r is the distance in metres
 * between neighbouring pixels on a surface that faces the camera. On this surface, a point 1 r from an edge is about
 * one pixel away from the edge. */

typedef struct maq_edges maq_edges;
typedef struct maq_edges_result maq_edges_result;

typedef struct maq_edges_config {
  uint32_t struct_size;
  maq_model_options model;   /* default bundle: share/maquette/models/edges-int8; MAQ_THREADS_MEASURED measures with a
                                frame of 320 x 240 */
  uint32_t result_pool_size; /* results the app may hold at once, 1 to 64; 0 (default): 4 */
  int32_t skip_planes;    /* 1: run the network only where depth is not flat within the sensor's noise: on a part of the
                             frame with half or all of each side. Elsewhere the distance is eps_r. This is faster and
                             may miss flat creases in noise. 0 (default): run on the whole frame. */
  int32_t average_frames; /* 2 to 64: average inverse depth over this number of frames, to reduce noise. The camera
                             must not move. Blocks of 32 x 32 px with motion, and pixels that jump, start a new average.
                             Unknown depth stays unknown. 0 (default) and 1: no averaging. */
} maq_edges_config;

/* The planes of a result: one value for each pixel of the depth frame. */
typedef enum maq_edges_plane {
  MAQ_EDGES_PLANE_DISTANCE = 1, /* float: distance in r to the nearest sharp feature curve, 0 to eps_r. It is eps_r
                                   where no curve is nearer or depth is unknown. */
  MAQ_EDGES_PLANE_EXPECTED_ERROR = 2, /* float: predicted mean absolute error of the distance, in r; eps_r where depth
                                         is unknown */
  MAQ_EDGES_PLANE_KIND = 3,           /* uint8_t: a maq_edges_kind, the kind of the nearest curve */
  MAQ_EDGES_PLANE_DEPTH = 4           /* float: depth in metres, averaged with average_frames; 0 where unknown */
} maq_edges_plane;

typedef enum maq_edges_kind {
  MAQ_EDGES_KIND_NONE = 0,    /* no curve is nearer than eps_r, or depth is unknown */
  MAQ_EDGES_KIND_CREASE = 1,  /* two surfaces meet, and both are visible */
  MAQ_EDGES_KIND_BOUNDARY = 2 /* the surface ends here; the visible surface behind it is farther away */
} maq_edges_kind;

typedef struct maq_edges_field {
  uint32_t struct_size;
  int32_t width_px; /* size of the planes and of the depth frame */
  int32_t height_px;
  float eps_r;               /* the largest distance; 16 in the bundles of this SDK */
  maq_intrinsics intrinsics; /* camera of the depth frame, without distortion */
} maq_edges_field;

/* Wall-clock times of the stages in milliseconds, and counts. */
typedef struct maq_edges_stats {
  uint32_t struct_size;
  float depth_ms;  /* convert depth to metres, average_frames */
  float skip_ms;   /* find the part for the network (skip_planes) */
  float slopes_ms; /* compute the network's input: slopes of inverse depth */
  float network_ms;
  float decode_ms;
  float total_ms;
  int64_t known_pixel_count;    /* pixels with known depth */
  int64_t network_pixel_count;  /* pixels the network ran on; 0: all depth unknown, or all flat and skipped */
  int64_t broken_pixel_count;   /* pixels with NaN from the network; their distance is eps_r */
  maq_provider provider;        /* provider in use */
  int32_t threads;              /* threads of the network; fewer if the system starts no more (see the log) */
  int32_t is_threads_measured;  /* 1: MAQ_THREADS_MEASURED chose the number of threads */
  int64_t averaged_pixel_count; /* pixels with the mean depth of several frames (average_frames) */
  int64_t far_pixel_count; /* pixels with depth beyond 50 m. If they are more than half of the known ones, the unit of
                              the depth is probably wrong, and maq_edges_run logs a warning once. */
} maq_edges_stats;

/* Fills `config` with the defaults and sets struct_size. `struct_size` is sizeof(maq_edges_config) of the caller.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_edges_config_init(maq_edges_config* config, uint32_t struct_size);

/* Loads a model bundle of the task "edges" and checks sizes and SHA-256 of its files. `config` may be NULL for the
 * defaults. The caller owns `*edges`: free it with maq_edges_destroy.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT, MAQ_ERROR_NOT_FOUND, MAQ_ERROR_BAD_BUNDLE, MAQ_ERROR_UNSUPPORTED (a
 * bundle of another task), MAQ_ERROR_RUNTIME_LIBRARY. Blocks while files are read, and while threads are measured. */
MAQ_API maq_status maq_edges_create(maq_context* context, const maq_edges_config* config, maq_edges** edges);

/* Frees the network (NULL is fine). Results stay valid until they are released.
 * Once for each handle, from any thread. May block briefly. */
MAQ_API void maq_edges_destroy(maq_edges* edges);

/* Computes the distance field of a depth frame, or of the depth that came with a colour frame. The frame must carry its
 * intrinsics (maq_frame_desc): frames of a calibrated source do. Distortion is ignored. The frame is not kept. The
 * first frame of a size prepares the network and takes longer. If no depth is known, the network does not run.
 * `*result` comes from a pool of result_pool_size: release it with maq_edges_result_release.
 * One at a time. Errors: MAQ_ERROR_UNSUPPORTED (a frame without depth or without intrinsics).
 * MAQ_ERROR_INVALID_ARGUMENT (intrinsics of another size, or with a focal length that is not positive).
 * MAQ_ERROR_IMAGE_SIZE (more than 8 million pixels). MAQ_ERROR_BAD_BUNDLE (the graph does not fit its manifest).
 * MAQ_ERROR_POOL_EMPTY, MAQ_ERROR_INFERENCE, MAQ_CANCELLED. Blocks while the network runs. */
MAQ_API maq_status maq_edges_run(maq_edges* edges, const maq_frame* frame, maq_edges_result** result);

/* Cancels the running maq_edges_run, or else the next one. It returns MAQ_CANCELLED after the current layer of the
 * network. Later runs are not affected.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_edges_cancel(maq_edges* edges);

/* Returns the result to its pool (NULL is fine). Pointers into it are invalid afterwards.
 * Once for each result, from any thread. Does not block. */
MAQ_API void maq_edges_result_release(maq_edges_result* result);

/* Gets the size of the planes, the largest distance and the camera. The caller sets field->struct_size.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_edges_result_get_field(const maq_edges_result* result, maq_edges_field* field);

/* Gets a plane: height_px rows of `*stride_bytes` bytes. The values are inside the result and valid until it is
 * released. maq_edges_plane gives their type.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_edges_result_get_plane(const maq_edges_result* result, maq_edges_plane plane,
                                              const void** values, size_t* stride_bytes);

/* Writes the distances in metres (distance * r) to `distance_m`: width_px * height_px floats, row by row, 0 where depth
 * is unknown. `count` is the capacity of `distance_m`, in floats. r uses the geometric mean of the two focal lengths.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT (`count` is too small). Does not block. */
MAQ_API maq_status maq_edges_result_copy_distance_m(const maq_edges_result* result, float* distance_m, size_t count);

/* Gets times and counts of the run. The caller sets stats->struct_size.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_edges_result_get_stats(const maq_edges_result* result, maq_edges_stats* stats);

/* Writes three files that begin with `path`, in a folder that exists (docs/reference/formats.md):
 *   <path>_distance.png   16 bits: thousandths of r
 *   <path>_kind.png       8 bits: maq_edges_kind
 *   <path>_edges.json     size, eps_r, intrinsics
 * Existing files are replaced atomically, after all three have been written.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT (`path` is empty or ends with '/'), MAQ_ERROR_UNWRITABLE.
 * Blocks while it writes. */
MAQ_API maq_status maq_edges_result_save(const maq_edges_result* result, const char* path);

#ifdef __cplusplus
}
#endif

#endif /* MAQUETTE_EDGES_H_ */
