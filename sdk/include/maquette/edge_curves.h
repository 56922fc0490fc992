/* Sharp feature curves of a depth frame: lines, arcs and splines in space, corners, sizes of boxes, snapping, and files
 * for CAD programs. They are computed only on request.
 *
 *   maq_edges_run(edges, frame, &result);
 *   maq_edges_result_find_curves(result, NULL, &curves);
 *   if (maq_edges_curves_get_box_count(curves) > 0) maq_edges_curves_get_box(curves, 0, &box);
 *   maq_edges_curves_save(curves, "box.step");
 *   maq_edges_curves_release(curves);
 */
#ifndef MAQUETTE_EDGE_CURVES_H_
#define MAQUETTE_EDGE_CURVES_H_

#include "maquette/edges.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Points and directions are three doubles, points in metres: x right, y down, z along the optical axis. r is the pixel
 * footprint of edges.h. px are pixels of the depth frame. */

typedef struct maq_edges_curves maq_edges_curves;

/* Settings of the curve search. The defaults suit all cameras and scenes, because lengths are in pixels. */
typedef struct maq_edges_curves_config {
  uint32_t struct_size;
  float min_length_px;   /* shorter curves are dropped, 4 to 1e6; 0 (default): 10 */
  int32_t skip_boxes;    /* 1: do not search for boxes; default 0 */
  float focal_tolerance; /* two standard deviations of the focal lengths of the frame's intrinsics, as a fraction: 0.01
                            is 1 %. At most 0.5; 0 (default): unknown. The tolerance of boxes includes it. */
} maq_edges_curves_config;

typedef enum maq_edges_curve_type {
  MAQ_EDGES_CURVE_LINE = 0,
  MAQ_EDGES_CURVE_ARC = 1,   /* a circular arc or a whole circle */
  MAQ_EDGES_CURVE_SPLINE = 2 /* a cubic B-spline */
} maq_edges_curve_type;

/* The convexity of a crease, seen from the camera's side. */
typedef enum maq_edges_convexity {
  MAQ_EDGES_CONVEXITY_UNKNOWN = 0,
  MAQ_EDGES_CONVEXITY_CONVEX = 1, /* like the edge of a box */
  MAQ_EDGES_CONVEXITY_CONCAVE = 2 /* like the edge between a wall and the floor */
} maq_edges_convexity;

/* A plane adjacent to a curve: all points X with normal . X = offset_m. */
typedef struct maq_edges_adjacent_plane {
  int32_t is_known;
  double normal[3]; /* length 1, towards the camera's side */
  double offset_m;
} maq_edges_adjacent_plane;

/* The pointers are valid until the curves are released. */
typedef struct maq_edges_curve {
  uint32_t struct_size;
  maq_edges_curve_type type;
  maq_edges_kind kind; /* crease or boundary */
  maq_edges_convexity convexity;
  int32_t is_closed;
  int32_t corners[2]; /* index of the corner at its start and at its end; -1: a free end */
  double length_m;
  double rms_footprints;  /* root mean square distance of the measured points from the curve, in r */
  const double* points_m; /* a polyline along the curve, point_count times x, y, z; the two ends of a line */
  uint32_t point_count;
  uint32_t control_count;   /* of a spline, else 0 */
  const double* controls_m; /* control points of a spline, x, y, z each: clamped, cubic, uniform knots; else NULL */
  double centre_m[3];       /* an arc is centre + cos(a) x_axis + sin(a) y_axis, 0 <= a <= sweep_rad; else 0 */
  double x_axis_m[3];       /* both axes are as long as the radius */
  double y_axis_m[3];
  double sweep_rad;
  maq_edges_adjacent_plane adjacent_planes[2]; /* known where the adjacent surface is flat */
} maq_edges_curve;

typedef struct maq_edges_corner {
  uint32_t struct_size;
  int32_t curve_count; /* number of curves that end here */
  double point_m[3];
} maq_edges_corner;

typedef struct maq_edges_box {
  uint32_t struct_size;
  int32_t corner_count;       /* visible corners: 4 of one face, 6 of two, 7 of three */
  double size_m[3];           /* lengths of the sides, the longest first */
  double size_tolerance_m[3]; /* two standard deviations of each length, from the fit and the spread of its ends and
                                 from focal_tolerance */
  double axes[3][3];          /* directions of the sides, length 1, at right angles */
  double centre_m[3];
  int32_t includes_focal_tolerance; /* 1: size_tolerance_m includes focal_tolerance; 0: that is unknown, and the
                                       tolerance is too small if the intrinsics are wrong */
} maq_edges_box;

typedef enum maq_edges_snap_target {
  MAQ_EDGES_SNAP_NOTHING = 0,
  MAQ_EDGES_SNAP_CORNER = 1,
  MAQ_EDGES_SNAP_CURVE = 2,
  MAQ_EDGES_SNAP_PLANE = 3 /* a plane adjacent to a curve */
} maq_edges_snap_target;

typedef struct maq_edges_snap {
  uint32_t struct_size;
  maq_edges_snap_target target;
  int32_t index;                /* index of the corner, the curve, or the plane's curve; -1 for nothing */
  int32_t adjacent_plane_index; /* for a plane, its index in adjacent_planes of that curve; else 0 */
  double point_m[3];            /* point of the target */
  double distance_px;           /* for a pixel: distance to the target in the image; 0 on a plane */
  double angle_rad;             /* for a ray: angle to the target, seen from the ray's origin; 0 on a plane */
} maq_edges_snap;

/* Wall-clock times in milliseconds, and counts of dropped candidates. */
typedef struct maq_edges_curves_stats {
  uint32_t struct_size;
  float curves_ms;
  float boxes_ms;
  int32_t bad_pixel_count;     /* pixels with a distance or depth that is not a number */
  int32_t voting_pixel_count;  /* pixels near an edge */
  int32_t chain_count;         /* candidates: chains of edge pixels. The fields below count dropped candidates. */
  int32_t short_chain_count;   /* shorter than min_length_px */
  int32_t without_depth_count; /* no adjacent surface with known depth */
  int32_t not_fitted_count;    /* no type of curve fitted */
  int32_t over_limit_count;    /* beyond the limit of 1024 curves */
} maq_edges_curves_stats;

/* Fills `config` with the defaults and sets struct_size. `struct_size` is sizeof(maq_edges_curves_config) of the
 * caller. Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_edges_curves_config_init(maq_edges_curves_config* config, uint32_t struct_size);

/* Finds the curves of a result, their corners, and boxes. `config` may be NULL for the defaults. A result without edges
 * has 0 curves. `*curves` comes from a pool with the result_pool_size of maq_edges: release it with
 * maq_edges_curves_release. It may outlive the result and maq_edges.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT, MAQ_ERROR_POOL_EMPTY. Blocks for some milliseconds. */
MAQ_API maq_status maq_edges_result_find_curves(const maq_edges_result* result, const maq_edges_curves_config* config,
                                                maq_edges_curves** curves);

/* Returns the curves to their pool (NULL is fine). Pointers into them are invalid afterwards.
 * Once for each object, from any thread. Does not block. */
MAQ_API void maq_edges_curves_release(maq_edges_curves* curves);

/* Return the number of curves, corners or boxes; 0 for NULL. Any thread. Do not fail or block. */
MAQ_API uint32_t maq_edges_curves_get_curve_count(const maq_edges_curves* curves);
MAQ_API uint32_t maq_edges_curves_get_corner_count(const maq_edges_curves* curves);
MAQ_API uint32_t maq_edges_curves_get_box_count(const maq_edges_curves* curves);

/* Get the curve, corner or box at `index` (from 0). Boxes are sorted by volume, the largest first. The caller sets
 * struct_size.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Do not block. */
MAQ_API maq_status maq_edges_curves_get_curve(const maq_edges_curves* curves, uint32_t index, maq_edges_curve* curve);
MAQ_API maq_status maq_edges_curves_get_corner(const maq_edges_curves* curves, uint32_t index,
                                               maq_edges_corner* corner);
MAQ_API maq_status maq_edges_curves_get_box(const maq_edges_curves* curves, uint32_t index, maq_edges_box* box);

/* Gets times and counts. The caller sets stats->struct_size.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_edges_curves_get_stats(const maq_edges_curves* curves, maq_edges_curves_stats* stats);

/* Finds the target at a position in the depth frame. It is the nearest corner within radius_px, or else the nearest
 * curve within radius_px. Otherwise it is the adjacent plane on which the pixel's depth lies. The position need not be
 * a whole pixel; (0, 0) is the centre of the first. The caller sets snap->struct_size.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT (a radius that is not 0 to 1e6; curves of a fusion, which have no
 * pixels). Does not block. */
MAQ_API maq_status maq_edges_curves_snap_to_pixel(const maq_edges_curves* curves, double x_px, double y_px,
                                                  double radius_px, maq_edges_snap* snap);

/* Finds the target of a ray from `origin_m` along `direction` (any length but 0), in the coordinates of the curves. It
 * is the nearest corner within max_angle_rad, or else the nearest curve. Angles are seen from the origin. Otherwise it
 * is the first adjacent plane that the ray hits where the depth frame shows that plane. The caller sets
 * snap->struct_size.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT (a direction of length 0, values that are not finite, an angle that is
 * not 0 to 1). Does not block. */
MAQ_API maq_status maq_edges_curves_snap_to_ray(const maq_edges_curves* curves, const double origin_m[3],
                                                const double direction[3], double max_angle_rad, maq_edges_snap* snap);

/* Writes the curves to a file. The extension of `path`, in small letters, chooses the format
 * (docs/reference/formats.md). It is .json (all data), .obj (lines), .ply (edges), .dxf (release 12), .step or .stp
 * (exact lines, circles, splines). The file is written atomically and replaces an existing one.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT (another extension), MAQ_ERROR_UNWRITABLE. Blocks while it writes. */
MAQ_API maq_status maq_edges_curves_save(const maq_edges_curves* curves, const char* path);

#ifdef __cplusplus
}
#endif

#endif /* MAQUETTE_EDGE_CURVES_H_ */
