/* Sharp feature curves of a depth frame: lines, arcs and splines in space, the corners in which they meet, the sizes of
 * boxes, what a pointer snaps to, and files that CAD programs open. Found only when an app asks for them.
 *
 *   maq_edges_run(edges, frame, &intrinsics, &result);
 *   maq_edges_result_find_curves(result, NULL, &curves);
 *   if (maq_edges_curves_get_box_count(curves) > 0) maq_edges_curves_get_box(curves, 0, &box);
 *   maq_edges_curves_save(curves, "box.step");
 */
#ifndef MAQUETTE_EDGE_CURVES_H_
#define MAQUETTE_EDGE_CURVES_H_

#include "maquette/edges.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Points and directions are three doubles, in metres: x right, y down, z along the optical axis. r is a footprint, as
 * in edges.h; px are pixels of the depth frame. */

typedef struct maq_edges_curves maq_edges_curves;

/* How curves are found. The defaults suit any camera and scene, as lengths are in px and r. */
typedef struct maq_edges_curves_config {
  uint32_t struct_size;
  float select_px;     /* pixels nearer than that to an edge say where it is, above 0 to 16; default 4 */
  float min_votes;     /* how many an edge needs, above 0 to 100: 1 is what all pixels on one side of it have together;
                          default 0.35 */
  float smear_px;      /* so near an edge depth may be of neither surface, 0 to 32; default 3 */
  float support_px;    /* surfaces beside an edge are fitted to a band so wide, beyond smear_px, and three times as wide
                          where depth is noisy, 2 to 64; default 8 */
  float break_deg;     /* a curve that turns by more at one place is two, above 0 to 180; default 15 */
  float min_length_px; /* shorter curves are left out, 4 to 1e6; default 10 */
  float tolerance_r;   /* the simplest type is taken that is so near the edge, above 0 to 16; default 0.5 */
  float gap_r;         /* surfaces farther apart along the ray do not meet in a crease, above 0 to 1e6; default 2.5 */
  float join_px;       /* ends so near the place where their curves meet share a corner, 0 to 64; default 12 */
  int32_t max_curves;  /* more are left out, and counted, 1 to 65536; default 1024 */
  int32_t find_boxes;  /* 1 (default): boxes are found too; 0: not */
} maq_edges_curves_config;

typedef enum maq_edges_curve_type {
  MAQ_EDGES_CURVE_LINE = 0,
  MAQ_EDGES_CURVE_ARC = 1,   /* of a circle, or a whole one */
  MAQ_EDGES_CURVE_SPLINE = 2 /* cubic B-spline */
} maq_edges_curve_type;

/* Of a crease, seen from the camera's side. */
typedef enum maq_edge_bend {
  MAQ_EDGE_BEND_UNKNOWN = 0,
  MAQ_EDGE_BEND_CONVEX = 1, /* as of a box */
  MAQ_EDGE_BEND_CONCAVE = 2 /* as between a wall and the floor */
} maq_edge_bend;

/* The plane beside a curve: points X with normal . X = offset_m. */
typedef struct maq_edges_side {
  int32_t is_known;
  double normal[3]; /* of length 1, to the camera's side */
  double offset_m;
} maq_edges_side;

/* Pointers lead into the curves, until these are released. */
typedef struct maq_edges_curve {
  uint32_t struct_size;
  maq_edges_curve_type type;
  maq_edge_kind kind; /* crease or boundary */
  maq_edge_bend bend;
  int32_t is_closed;
  int32_t corners[2]; /* index of the corner at its start and at its end; -1: it ends freely */
  double length_m;
  double rms_r;           /* root mean square distance, in r, of the places that it was fitted to */
  const double* points_m; /* the polyline that is drawn of it, point_count times x, y, z; of a line its two ends */
  uint32_t point_count;
  uint32_t control_count;   /* of a spline, else 0 */
  const double* controls_m; /* control points of a spline, x, y, z each: clamped, cubic, with even knots; else NULL */
  double centre_m[3]; /* an arc is centre + cos(a) x_axis + sin(a) y_axis, 0 <= a <= sweep_rad; both axes are as */
  double x_axis_m[3]; /* long as the radius; else 0 */
  double y_axis_m[3];
  double sweep_rad;
  maq_edges_side sides[2]; /* where they are flat */
} maq_edges_curve;

typedef struct maq_edges_corner {
  uint32_t struct_size;
  int32_t curve_count; /* how many curves end in it */
  double point_m[3];
} maq_edges_corner;

typedef struct maq_edges_box {
  uint32_t struct_size;
  int32_t corner_count;   /* of its eight, how many were seen */
  double size_m[3];       /* its sides, the longest first */
  double plus_minus_m[3]; /* of each: two standard deviations, from how far its edges disagree and how well they fit */
  double axes[3][3];      /* the direction of each, of length 1, at right angles */
  double centre_m[3];
} maq_edges_box;

typedef enum maq_edges_snap_target {
  MAQ_EDGES_SNAP_NOTHING = 0,
  MAQ_EDGES_SNAP_CORNER = 1,
  MAQ_EDGES_SNAP_CURVE = 2,
  MAQ_EDGES_SNAP_PLANE = 3 /* beside a curve */
} maq_edges_snap_target;

typedef struct maq_edges_snap {
  uint32_t struct_size;
  maq_edges_snap_target target;
  int32_t index;      /* of the corner or the curve; of a plane, of a curve that it is beside; else -1 */
  int32_t side;       /* of a plane: which of that curve's sides; else 0 */
  double point_m[3];  /* of the target */
  double distance_px; /* of a pixel: how far the target is from it in the picture, 0 on a plane */
  double angle_rad;   /* of a ray: how far the target is from it as seen from its origin, 0 on a plane */
} maq_edges_snap;

/* Time in wall-clock milliseconds, and what was left out. */
typedef struct maq_edges_curves_stats {
  uint32_t struct_size;
  float curves_ms;
  float boxes_ms;
  int32_t bad_pixel_count;     /* whose distance or depth is no number */
  int32_t voting_pixel_count;  /* near an edge */
  int32_t chain_count;         /* runs of pixels that may be curves; of these are left out: */
  int32_t short_chain_count;   /* under min_length_px */
  int32_t without_depth_count; /* no surface of known depth is beside them */
  int32_t not_fitted_count;    /* no type of curve came near them */
  int32_t over_limit_count;    /* over max_curves */
} maq_edges_curves_stats;

/* Fills `config` with the defaults and sets struct_size. `struct_size` is sizeof(maq_edges_curves_config) of the
 * caller. Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_edges_curves_config_init(maq_edges_curves_config* config, uint32_t struct_size);

/* Finds the curves of a result, their corners, and boxes. `config` may be NULL for the defaults. `*curves` comes from a
 * pool of the result_pool_size of maq_edges: give it back with maq_edges_curves_release. It outlives the result and
 * maq_edges. A result without edges has 0 curves.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT, MAQ_ERROR_POOL_EMPTY. Blocks while it computes, for some
 * milliseconds. */
MAQ_API maq_status maq_edges_result_find_curves(const maq_edges_result* result, const maq_edges_curves_config* config,
                                                maq_edges_curves** curves);

/* Gives the curves back (NULL is fine). Pointers into them are invalid afterwards.
 * Once for each, from any thread. Does not block. */
MAQ_API void maq_edges_curves_release(maq_edges_curves* curves);

/* Return how many there are; 0 for NULL. Any thread. Do not fail or block. */
MAQ_API uint32_t maq_edges_curves_get_curve_count(const maq_edges_curves* curves);
MAQ_API uint32_t maq_edges_curves_get_corner_count(const maq_edges_curves* curves);
MAQ_API uint32_t maq_edges_curves_get_box_count(const maq_edges_curves* curves);

/* Get the curve, corner or box with an index from 0; boxes are in the order of their volume, the largest first. The
 * caller sets struct_size.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Do not block. */
MAQ_API maq_status maq_edges_curves_get_curve(const maq_edges_curves* curves, uint32_t index, maq_edges_curve* curve);
MAQ_API maq_status maq_edges_curves_get_corner(const maq_edges_curves* curves, uint32_t index,
                                               maq_edges_corner* corner);
MAQ_API maq_status maq_edges_curves_get_box(const maq_edges_curves* curves, uint32_t index, maq_edges_box* box);

/* Gets times and counts. The caller sets stats->struct_size.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_edges_curves_get_stats(const maq_edges_curves* curves, maq_edges_curves_stats* stats);

/* Finds what is at a pixel of the depth frame, which may be any place, (0, 0) the centre of the first: the nearest
 * corner within radius_px of it, or else the nearest curve, or else the plane beside a curve that the pixel's depth
 * lies on. `snap->target` says which; the caller sets snap->struct_size. Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT
 * (a radius that is not 0 to 1e6). Does not block. */
MAQ_API maq_status maq_edges_curves_snap_to_pixel(const maq_edges_curves* curves, double x_px, double y_px,
                                                  double radius_px, maq_edges_snap* snap);

/* The same for a ray from `origin_m` along `direction` (of any length, not 0), both in the coordinates of the curves:
 * the nearest corner or curve within max_angle_rad of it as seen from the origin, or else the plane beside a curve that
 * it hits first, where the depth frame has seen that plane.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT (a direction of length 0, what is not finite, an angle that is not 0
 * to 1). Does not block. */
MAQ_API maq_status maq_edges_curves_snap_to_ray(const maq_edges_curves* curves, const double origin_m[3],
                                                const double direction[3], double max_angle_rad, maq_edges_snap* snap);

/* Writes the curves to a file by the ending of its name, in small letters, as docs/formats.md has them: .json (all
 * there is), .obj (lines), .ply (edges), .dxf (release 12) or .step (lines, circles and B-splines, exactly). It is
 * written atomically and replaces an existing one.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT (another ending), MAQ_ERROR_UNWRITABLE. Blocks while it is written. */
MAQ_API maq_status maq_edges_curves_save(const maq_edges_curves* curves, const char* path);

#ifdef __cplusplus
}
#endif

#endif /* MAQUETTE_EDGE_CURVES_H_ */
