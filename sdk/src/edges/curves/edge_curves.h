// Sharp feature curves of one or several depth frames: lines, circular arcs and cubic B-splines, and the corners where
// they meet. Coordinates are in the camera or in the world.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "core/math/vec3.h"
#include "edges/edge_field.h"

namespace maq {

// r: a footprint (edge_field.h). px: pixels of the frame.
inline constexpr float kVoteRadiusPx = 4;       // pixels nearer than this to an edge vote for its position
inline constexpr float kMinVotes = 0.35f;       // votes an edge needs; 1 is the sum of all votes from one side
inline constexpr float kFlyingPixelBandPx = 3;  // half-width of the band of mixed pixels: no plane is fitted to it
inline constexpr float kFitBandPx = 8;          // width of the band beyond it to which surfaces are fitted
inline constexpr float kSplitAngleDeg = 15;     // a curve that turns by more at one point is split
inline constexpr float kToleranceR = 0.5f;      // the simplest type with this root mean square distance is taken
inline constexpr float kGapR = 2.5f;            // surfaces farther apart along the ray do not meet in a crease
inline constexpr float kMergeRadiusPx = 12;     // ends this near the point where their curves meet share a corner

struct CurveOptions {
  float min_length_px = 10;  // shorter curves are dropped, except for the 3 px that a corner may hide
  int max_curves = 1024;     // more are dropped and counted
};

enum class CurveType : uint8_t { kLine, kArc, kSpline };

enum class Convexity : uint8_t { kUnknown, kConvex, kConcave };  // for a crease, seen from the camera's side

// The points X with dot(normal, X) = offset_m; the normal has length 1 and points to the camera.
struct Plane {
  Vec3 normal;
  double offset_m = 0;
};

struct EdgeCurve {
  EdgeKind kind = kCreaseEdge;
  Convexity convexity = Convexity::kUnknown;
  CurveType type = CurveType::kLine;
  bool is_closed = false;
  std::array<int, 2> corner = {-1, -1};  // at its start and end; -1: a free end
  // The adjacent planes, to the left and right of the polyline in the image; valid where has_plane.
  std::array<bool, 2> has_plane = {false, false};
  std::array<Plane, 2> plane;
  double length_m = 0;
  double rms_footprints = 0;  // root mean square distance of the measured points, in r
  // An arc: centre + cos(a) * x_axis + sin(a) * y_axis, 0 <= a <= sweep_rad. Both axes are as long as the radius.
  Vec3 centre, x_axis, y_axis;
  double sweep_rad = 0;
  // The polyline, in EdgeCurves::points; the two ends of a line.
  int first_point = 0, point_count = 0;
  // The control points of a spline, in EdgeCurves::controls: cubic, clamped, uniform knots.
  int first_control = 0, control_count = 0;
};

// Returns the divisor of a footprint, depth / focal_px: the geometric mean if pixels are not square.
inline double focal_px(const Intrinsics& camera) { return std::sqrt(camera.fx_px * camera.fy_px); }

struct EdgeCorner {
  Vec3 point;
  int curve_count = 0;  // number of ends that meet here
};

// Counts of pixels and chains, and of dropped chains.
struct CurveCounts {
  int bad_pixels = 0;     // distance or depth not finite, or negative
  int voting_pixels = 0;  // pixels that voted
  int chains = 0;         // candidates: runs of ridge pixels
  int short_chains = 0;   // under min_length_px
  int without_depth = 0;  // no surface with known depth beside them
  int not_fitted = 0;     // no type of curve fitted
  int over_limit = 0;     // beyond max_curves
};

struct EdgeCurves {
  std::vector<EdgeCurve> curves;
  std::vector<EdgeCorner> corners;
  std::vector<Vec3> points, controls;  // of all curves
  CurveCounts counts;
  bool in_world = false;  // world coordinates of several cameras, not coordinates of one camera
};

}  // namespace maq
