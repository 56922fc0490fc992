// Sharp feature curves of a depth frame, or of several: lines, circular arcs and cubic B-splines in camera coordinates,
// or in those of the world; and the corners in which they meet.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "core/math/vec3.h"
#include "edges/edge_field.h"

namespace maq {

// r: a footprint (edge_field.h). px: pixels of the frame.
struct CurveOptions {
  float select_px = 4;       // pixels nearer than that to an edge say where it is
  float min_votes = 0.35f;   // how many an edge needs: 1 is what all pixels on one side of it have together
  float smear_px = 3;        // so near an edge depth may be of neither surface: no plane is fitted to it
  float support_px = 8;      // planes and patches are fitted to a band so wide, beyond smear_px; wider in noise
  float break_deg = 15;      // a curve that turns by more at one place is two
  float min_length_px = 10;  // shorter curves are left out, but for the 3 px that a corner may hide
  float tolerance_r = 0.5f;  // the simplest type is taken that is so near its points (root of the mean square)
  float gap_r = 2.5f;        // surfaces that are farther apart along the ray do not meet in a crease
  float join_px = 12;        // ends so near the place where their curves meet share a corner
  int max_curves = 1024;     // more are left out, and counted

  bool operator==(const CurveOptions& o) const {
    return select_px == o.select_px && min_votes == o.min_votes && smear_px == o.smear_px &&
           support_px == o.support_px && break_deg == o.break_deg && min_length_px == o.min_length_px &&
           tolerance_r == o.tolerance_r && gap_r == o.gap_r && join_px == o.join_px && max_curves == o.max_curves;
  }
};

enum class CurveType : uint8_t { kLine, kArc, kSpline };

enum class Bend : uint8_t { kUnknown, kConvex, kConcave };  // of a crease, seen from the camera's side

// The points X with dot(normal, X) = offset_m; the normal has length 1 and points to the camera.
struct Plane {
  Vec3 normal;
  double offset_m = 0;
};

struct EdgeCurve {
  EdgeKind kind = kCreaseEdge;
  Bend bend = Bend::kUnknown;
  CurveType type = CurveType::kLine;
  bool is_closed = false;
  std::array<int, 2> corner = {-1, -1};  // at its start and end; -1: a free end
  // The planes on either side, to its left and right as its polyline goes up the picture's axes; valid where has_plane.
  std::array<bool, 2> has_plane = {false, false};
  std::array<Plane, 2> plane;
  double length_m = 0;
  double rms_r = 0;  // of the points that it was fitted to, from it
  // An arc: centre + cos(a) * x_axis + sin(a) * y_axis, 0 <= a <= sweep_rad. Both axes are as long as the radius.
  Vec3 centre, x_axis, y_axis;
  double sweep_rad = 0;
  // A line from first to last point; of a spline and an arc what is drawn of them: EdgeCurves::points.
  int first_point = 0, point_count = 0;
  // A spline's control points, of EdgeCurves::controls: cubic, clamped, with even knots.
  int first_control = 0, control_count = 0;
};

// A footprint is depth / that: the mean where pixels are not square.
inline double focal_px(const Intrinsics& camera) { return std::sqrt(camera.fx_px * camera.fy_px); }

struct EdgeCorner {
  Vec3 point;
  int curve_count = 0;  // how many ends meet in it
};

// What was left out, and of what.
struct CurveCounts {
  int bad_pixels = 0;     // distance or depth not finite, or negative
  int voting_pixels = 0;  // those that said where an edge is
  int chains = 0;         // runs of ridge pixels
  int short_chains = 0;   // under min_length_px
  int without_depth = 0;  // no surface with known depth beside them
  int not_fitted = 0;     // no type of curve came near them
  int over_limit = 0;     // beyond max_curves
};

struct EdgeCurves {
  std::vector<EdgeCurve> curves;
  std::vector<EdgeCorner> corners;
  std::vector<Vec3> points, controls;  // of all curves
  CurveCounts counts;
  bool in_world = false;  // coordinates are those of the world of several cameras, not of one camera
};

}  // namespace maq
