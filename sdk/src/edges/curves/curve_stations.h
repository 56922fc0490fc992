// Stations along one chain at which an edge is measured: its position across from the field, its depth from the
// surfaces on either side.
#pragma once

#include <array>
#include <vector>

#include "edges/curves/edge_curves.h"
#include "edges/curves/ridge_chains.h"
#include "edges/curves/surface_patch.h"

namespace maq {

inline constexpr double kLongestStep_r = 6;  // length of a pixel along a curve that runs away from the camera

struct CurveStation {
  double x, y, tx, ty;   // px: the edge, and its direction in the image; side 0 is on its left, at (ty, -tx)
  double across_weight;  // inverse variance of the position across the edge, 1/px^2
  std::array<SurfacePatch, 2> side;
  bool is_boundary;
  int near_side;                      // the side that ends at the edge; -1: both
  double gap_r;                       // of side 1 behind side 0 along the ray
  double field_gap_px;                // by how much farther away the field has an edge on side 1 than on side 0
  std::array<int, 2> boundary_votes;  // pixels near it with the kind boundary, minus pixels with the kind crease
  bool is_known;                      // it has a point
  Vec3 point;
  double sigma_r;  // of the point, the worst of its directions
};

// Stations that follow one another and are of one kind, at the end of the same surfaces.
struct StationRun {
  int first, count;
  EdgeKind kind;
  int near_side;  // of all its stations
};

class CurveStations {
 public:
  std::vector<CurveStation> stations;
  std::vector<StationRun> runs;  // in turn; stations between them are of no edge
  bool is_straight = false;      // in the image
  // The sides of a straight chain, if they are planes along its whole length.
  std::array<SurfacePatch, 2> whole_side;

  // Returns false if no surface is known beside the chain.
  bool measure(const EdgeField& field, const RidgePoint* points, const RidgeChain& chain);

  // After measure(): two edges, one behind the other, are one chain. Stations and runs become the farther one's;
  // returns false if there is none.
  bool measure_far_side(const EdgeField& field);

 private:
  void place(const RidgePoint* points, const RidgeChain& chain);
  // The pixels beside a station, sampled along and across the edge.
  struct Band {
    int side;
    double half_window_px, to_px;
    int step_px;
  };
  void gather_band(const EdgeField& field, const CurveStation& s, const Band& band, double from_px);
  SurfacePatch fit_side(const EdgeField& field, const CurveStation& s, int side, double half_window_px, bool may_bend);
  SurfacePatch fit_noisy_side(const EdgeField& field, const CurveStation& s, int side, double half_window_px,
                              bool may_bend);
  void fit_sides(const EdgeField& field);
  void fit_whole_sides(const EdgeField& field);
  void choose_kinds(const EdgeField& field, bool is_closed);
  void measure_field_gaps(const EdgeField& field);
  void find_runs(bool is_closed);
  void move_across(const EdgeField& field);
  void straighten();
  bool find_points(const EdgeField& field);
  void part_at_gaps(const EdgeField& field);
  bool has_far_edge(const EdgeField& field, const CurveStation& s) const;

  double half_window_px_ = 0;
  PatchFitter fitter_;
  std::vector<BandPixel> band_, narrow_;
  std::vector<PlaneSums> sums_;  // of each station's sides
  std::vector<double> shifts_, residuals_;
  std::vector<StationRun> parts_;
};

}  // namespace maq
