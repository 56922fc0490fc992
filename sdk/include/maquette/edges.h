/* Edges: how far each point of a depth frame is from the nearest sharp feature curve. */
#ifndef MAQUETTE_EDGES_H_
#define MAQUETTE_EDGES_H_

#include "maquette/source.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Lengths are in footprints: r = depth / focal length, metres between neighbouring pixels of a surface that faces the
 * camera at that depth. A point 1 r from an edge is about a pixel from it where the surface faces the camera. */

typedef struct maq_edges maq_edges;
typedef struct maq_edges_result maq_edges_result;

typedef struct maq_edges_config {
  uint32_t struct_size;
  int32_t threads;         /* 1 to 64; 0 (default): the machine's large cores, at most 4; MAQ_THREADS_MEASURED: as
                              many of these as pay, measured with a frame of 320 x 240 */
  const char* bundle_path; /* folder with manifest.json; NULL (default): bundle_files, or without them the bundle
                                 installed with the library (share/maquette/models/edges-int8). Copied. */
  const maq_memory_file* bundle_files; /* the bundle's files in memory, instead of bundle_path; default NULL. Copied. */
  uint32_t bundle_file_count;          /* default 0 */
  uint32_t result_pool_size;           /* results the app may hold at once, 1 to 64; default 4 */
  int32_t allow_spinning; /* 1 (default): idle threads spin for a while; 0: they sleep, which saves energy and costs
                                   some speed */
  maq_provider provider;  /* for the network; default MAQ_PROVIDER_CPU. One that cannot be had, or that takes less than
                             half of the network, is replaced by the CPU: the log says why. */
  int32_t skip_planes;    /* 1: the network runs only on the part of a frame, half or all of each side, that has areas
                             which a plane does not explain within the sensor's noise; elsewhere the distance is eps_r.
                             Faster, and may miss flat creases in noise. 0 (default): on the whole frame */
  int32_t average_frames; /* 2 to 64: depth is the mean of inverse depth over so many frames, one after the other, of a
                             camera at rest, which takes noise away. Areas of 32 x 32 px in which something moves, and
                             pixels that jump, begin anew; unknown depth stays unknown. 0 (default), 1: each frame is
                             on its own */
} maq_edges_config;

/* The planes of a result: a value a pixel of the depth frame. */
typedef enum maq_edges_plane {
  MAQ_EDGES_PLANE_DISTANCE = 1, /* float: r to the nearest sharp feature curve, 0 to eps_r; eps_r: none is nearer, or
                                   depth is unknown */
  MAQ_EDGES_PLANE_SPREAD = 2,   /* float: r by which that may be wrong, its mean absolute error as the network expects
                                   it; eps_r where depth is unknown */
  MAQ_EDGES_PLANE_KIND = 3,     /* uint8_t: a maq_edge_kind of that curve */
  MAQ_EDGES_PLANE_DEPTH = 4     /* float: the frame's depth in metres, or its mean with frames before it
                                   (average_frames); 0 where it is unknown */
} maq_edges_plane;

typedef enum maq_edge_kind {
  MAQ_EDGE_NONE = 0,    /* no curve is nearer than eps_r, or depth is unknown */
  MAQ_EDGE_CREASE = 1,  /* two surfaces meet in it, and both are seen */
  MAQ_EDGE_BOUNDARY = 2 /* the surface ends there and what is seen beyond is farther away: its other side is hidden */
} maq_edge_kind;

typedef struct maq_edges_field {
  uint32_t struct_size;
  int32_t width_px; /* of the planes, which is the depth frame's */
  int32_t height_px;
  float eps_r;               /* distances are cut off there; 16 in the bundles of this SDK */
  maq_intrinsics intrinsics; /* of the depth frame, without distortion */
} maq_edges_field;

/* Times of the stages of a run, in wall-clock milliseconds, and counts. */
typedef struct maq_edges_stats {
  uint32_t struct_size;
  float depth_ms;  /* depth to metres, and average_frames */
  float skip_ms;   /* where the network must run (skip_planes) */
  float slopes_ms; /* the network's input: slopes of inverse depth */
  float network_ms;
  float decode_ms;
  float total_ms;
  int64_t known_pixel_count;    /* whose depth is known */
  int64_t network_pixel_count;  /* that the network was run on; 0: nothing was known, or all was planes that were
                                   skipped */
  int64_t broken_pixel_count;   /* for which the network gave no number, but NaN: they have the distance eps_r */
  maq_provider provider;        /* in use for the network */
  int32_t threads;              /* of the network; fewer where the system starts no more, as the log says then */
  int32_t is_threads_measured;  /* 1: that number was chosen by MAQ_THREADS_MEASURED */
  int64_t averaged_pixel_count; /* whose depth is the mean of several frames (average_frames) */
} maq_edges_stats;

/* Fills `config` with the defaults and sets struct_size. `struct_size` is sizeof(maq_edges_config) of the caller.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_edges_config_init(maq_edges_config* config, uint32_t struct_size);

/* Loads a model bundle of the task "edges" and checks its files' sizes and SHA-256. `config` may be NULL for the
 * defaults. `*edges` is the caller's, to be given to maq_edges_destroy.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT, MAQ_ERROR_NOT_FOUND, MAQ_ERROR_BAD_BUNDLE, MAQ_ERROR_UNSUPPORTED (a
 * bundle of another task), MAQ_ERROR_RUNTIME_LIBRARY. Blocks while files are read, and while threads are measured. */
MAQ_API maq_status maq_edges_create(maq_context* context, const maq_edges_config* config, maq_edges** edges);

/* Frees the network (NULL is fine). Results still held stay valid until they are released.
 * Once for each handle, from any thread. May block briefly. */
MAQ_API void maq_edges_destroy(maq_edges* edges);

/* Finds the field of a depth frame: its own pixels (MAQ_PIXEL_DEPTH16, MAQ_PIXEL_DEPTH32F), or the depth that came with
 * its picture. `intrinsics` are those of the frame (maq_source_get_intrinsics): of the depth image's size or, of depth
 * that came with a picture, of the picture's. Their distortion is left out of account. Neither is kept. The first
 * frame of a size prepares the network for it. `*result` comes from a pool of result_pool_size: give it back with
 * maq_edges_result_release. Where nothing is known, the network does not run.
 * One at a time. Errors: MAQ_ERROR_INVALID_ARGUMENT (no intrinsics, those of another size, a focal length that is not
 * positive), MAQ_ERROR_UNSUPPORTED (a frame without depth), MAQ_ERROR_IMAGE_SIZE (more than 8 million pixels),
 * MAQ_ERROR_POOL_EMPTY, MAQ_ERROR_BAD_BUNDLE (the graph is not what the manifest says), MAQ_ERROR_INFERENCE,
 * MAQ_CANCELLED. Blocks while the network runs. */
MAQ_API maq_status maq_edges_run(maq_edges* edges, const maq_frame* frame, const maq_intrinsics* intrinsics,
                                 maq_edges_result** result);

/* Cancels the maq_edges_run that runs, or else the next: it returns MAQ_CANCELLED as soon as the layer of the network
 * that runs is done. Later ones run as usual.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_edges_cancel(maq_edges* edges);

/* Gives the result back (NULL is fine). Pointers into it are invalid afterwards.
 * Once for each result, from any thread. Does not block. */
MAQ_API void maq_edges_result_release(maq_edges_result* result);

/* Gets the size of the planes, where distances end, and the camera. The caller sets field->struct_size.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_edges_result_get_field(const maq_edges_result* result, maq_edges_field* field);

/* Gets a plane: height_px rows of `*stride_bytes` bytes, inside the result, of the type that maq_edges_plane says.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_edges_result_get_plane(const maq_edges_result* result, maq_edges_plane plane,
                                              const void** values, size_t* stride_bytes);

/* Writes the distances in metres (distance * r) to `distance_m`, width_px * height_px floats row by row; 0 where depth
 * is unknown. `count` is how many have room there. With two focal lengths, r is that of their geometric mean.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT (too little room). Does not block. */
MAQ_API maq_status maq_edges_result_copy_distance_m(const maq_edges_result* result, float* distance_m, size_t count);

/* Gets times and counts of the run. The caller sets stats->struct_size.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_edges_result_get_stats(const maq_edges_result* result, maq_edges_stats* stats);

/* Writes three files into an existing folder ("": the current one), as docs/formats.md has them: <stem>_distance.png
 * (16 bits: thousandths of r), <stem>_kind.png (8 bits: maq_edge_kind) and <stem>_edges.json (size, eps_r, intrinsics).
 * Each is written atomically and replaces an existing one, after all have been written. `stem` begins their names and
 * names no folder.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT, MAQ_ERROR_UNWRITABLE, MAQ_ERROR_RUNTIME_LIBRARY
 * (libmaquette_files.so is missing). Blocks while they are written. */
MAQ_API maq_status maq_edges_result_save(const maq_edges_result* result, const char* folder, const char* stem);

#ifdef __cplusplus
}
#endif

#endif /* MAQUETTE_EDGES_H_ */
