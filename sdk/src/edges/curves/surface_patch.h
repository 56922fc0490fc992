// The surface beside an edge: inverse depth as a polynomial of the pixel, fitted beyond the band of flying pixels.
#pragma once

#include <array>
#include <vector>

#include "edges/curves/edge_curves.h"

namespace maq {

// The inverse depth of a plane is linear in the pixel for any tilt. A curved patch also has squares.
struct SurfacePatch {
  int terms = 0;                        // 0: no surface is known, 3: a plane, 6: with squares
  double x = 0, y = 0;                  // px: the position around which it was fitted
  std::array<double, 6> coefficient{};  // of 1, u, v, uu, uv, vv with u, v = (pixel - place) / kPatchScale_px; 1/m
  double rms_footprints = 0;            // of the pixels' depth from it, along the ray
  double edge_sigma_r = 0;              // of its depth at (x, y), along the ray

  double inverse_depth(double at_x, double at_y) const;
  // The change of inverse depth by one pixel in x and in y.
  std::array<double, 2> slope(double at_x, double at_y) const;
};

inline constexpr double kPatchScale_px = 8;

// A pixel beside an edge.
struct BandPixel {
  double x, y, inverse_depth;
  double weight;
  double across;  // px from the edge
};

// Sums of a plane's normal equations, which can be added for several bands.
struct PlaneSums {
  double x = 0, y = 0, unit = 0;  // px: their position; 1/m: about the inverse depth of the pixels
  std::array<double, 6> a{};      // 1, u, v, uu, uv, vv
  std::array<double, 3> b{};
  double squares = 0, weight = 0;

  void begin(double at_x, double at_y, double inverse_depth);
  void add(const BandPixel& pixel);
  void add(const PlaneSums& other);  // of the same position
  // Returns terms = 0 if the sums do not determine a plane. `edge`: the point for edge_sigma_r.
  SurfacePatch solve(double focal_px, double edge_x, double edge_y) const;
};

class PatchFitter {
 public:
  // Fits a plane with a robust weight, because some pixels may belong to another surface. With `may_bend`, fits a patch
  // with squares if it is much nearer to the pixels. Sets the weights of the pixels.
  SurfacePatch fit(std::vector<BandPixel>& pixels, double x, double y, double focal_px, bool may_bend);

 private:
  double scale_of_residuals(const std::vector<BandPixel>& pixels, const SurfacePatch& patch, double focal_px);

  std::vector<double> residuals_;
};

// Returns the plane of a patch of three terms, in camera coordinates.
Plane plane_of(const SurfacePatch& patch, const Intrinsics& camera);

}  // namespace maq
