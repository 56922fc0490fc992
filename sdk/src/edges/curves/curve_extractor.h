// From the distance field of a frame to its sharp feature curves (DEF, arXiv 2011.15081, section 6, made for live use).
#pragma once

#include <vector>

#include "edges/curves/arc_fit.h"
#include "edges/curves/corners.h"
#include "edges/curves/curve_stations.h"
#include "edges/curves/edge_curves.h"
#include "edges/curves/ridge_chains.h"
#include "edges/curves/ridge_votes.h"
#include "edges/curves/spline_fit.h"

namespace maq {

class CurveExtractor {
 public:
  // Throws MAQ_ERROR_INVALID_ARGUMENT for an option out of range.
  explicit CurveExtractor(const CurveOptions& options = {}) { set_options(options); }
  void set_options(const CurveOptions& options);

  // Returns curves that are valid until the next call. Keeps memory from frame to frame. Accepts any field: values that
  // are not numbers are dropped and counted, a field without edges has no curves. Throws MAQ_ERROR_INVALID_ARGUMENT for
  // planes of another size and focal lengths that are not positive.
  const EdgeCurves& extract(const EdgeField& field);

 private:
  // A curve before its corners are known.
  struct Draft {
    EdgeCurve curve;
    std::array<Vec3, 2> end, outward;
    std::array<double, 2> r_m, step_m;  // a footprint, and a pixel along the curve, at its ends
  };
  void draft_curves(const EdgeField& field, const RidgeChain& chain);
  void draft_runs(const EdgeField& field, const RidgeChain& chain);
  bool draft_arcs(const EdgeField& field, const RidgeChain& chain);
  bool fit_run(const EdgeField& field, const RidgeChain& chain, const StationRun& run, Draft& draft);
  void gather_points(const EdgeField& field, const StationRun& run);
  bool place_line(const EdgeField& field, const RidgeChain& chain, const StationRun& run, Draft& draft) const;
  void describe_sides(const EdgeField& field, const StationRun& run, EdgeCurve& curve) const;
  bool is_along_rays(const EdgeField& field, const StationRun& run, const Draft& draft) const;
  void keep(const EdgeField& field, const StationRun& run, Draft& draft);
  void lengthen_end(const EdgeField& field, Draft& draft, int which) const;
  void join_corners(const EdgeField& field);
  void move_end(Draft& draft, int which, Vec3 to);

  CurveOptions options_;
  RidgeVotes votes_;
  RidgeChains chains_;
  CurveStations stations_;
  ArcFitter arc_fitter_;
  SplineFitter spline_fitter_;
  CornerFinder corner_finder_;
  std::vector<FitPoint> fit_points_;
  std::vector<Draft> drafts_;
  std::vector<CurveEnd> ends_;
  EdgeCurves found_;
};

}  // namespace maq
