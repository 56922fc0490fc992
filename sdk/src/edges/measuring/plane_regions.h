// The flat parts of a depth frame: connected pixels whose inverse depth is linear in the image, as that of a plane is.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "edges/curves/edge_curves.h"

namespace maq {

// Sums for the plane 1 / z = a x + b y + c, where a pixel's ray is (x, y, 1).
struct InversePlaneSums {
  double n = 0, x = 0, y = 0, w = 0, xx = 0, xy = 0, yy = 0, xw = 0, yw = 0, ww = 0;

  void add(const InversePlaneSums& other);
  void add(double at_x, double at_y, double inverse_depth);
};

struct InversePlane {
  double a = 0, b = 0, c = 0;

  double at(double x, double y) const { return a * x + b * y + c; }
};

// Least squares. Returns false if the points lie on a line or are fewer than three. `rms` gets the root mean square
// residual of inverse depth.
bool fit_inverse_plane(const InversePlaneSums& sums, InversePlane& plane, double& rms);

// The root mean square residual of inverse depth of points from a plane.
double rms_from(const InversePlaneSums& sums, const InversePlane& plane);

// The standard deviation of depth at a depth: constant_m + square_per_m * depth^2. The first part is that of time of
// flight, the second that of disparity.
struct DepthError {
  double constant_m = 0, square_per_m = 0;

  double at(double depth_m) const { return constant_m + square_per_m * depth_m * depth_m; }
};

struct PlaneRegion {
  InversePlaneSums sums;
  InversePlane inverse;
  Plane plane;
  double rms_m = 0;                              // of its pixels' distances from the plane, along their rays
  double slack = 1;                              // by which the tolerance of its pixels is multiplied
  Vec3 centre;                                   // mean of its points
  int pixels() const { return int(sums.n); }     // of the grid
  int left = 0, top = 0, right = 0, bottom = 0;  // of the grid, inclusive
};

// Reads every `step`th pixel of a frame: the grid. Keeps memory from frame to frame.
class PlaneRegions {
 public:
  static constexpr int kMaxRegions = 255;

  // `field`: only its depth and intrinsics are read.
  void find(const EdgeField& field);

  int step() const { return step_; }
  int width() const { return width_; }
  int height() const { return height_; }
  const std::vector<PlaneRegion>& regions() const { return regions_; }
  // 0: no region, else the index of a region plus 1.
  uint8_t label(int column, int row) const { return labels_[size_t(row) * size_t(width_) + size_t(column)]; }
  float ray_x(int column) const { return x_[size_t(column)]; }
  float ray_y(int row) const { return y_[size_t(row)]; }
  const std::vector<uint8_t>& labels() const { return labels_; }
  // How round a region is: the height of its arc, as a fraction of the chord, where it bends most.
  double roundness(int region) const;
  const DepthError& error() const { return error_; }
  // Depth that differs by less from a plane belongs to it, as inverse depth.
  double tolerance(double inverse_depth) const;

  // The number of neighbouring pixels of two regions, by index; a few pixels of neither may lie between.
  int contacts(size_t a, size_t b) const { return contacts_[std::min(a, b) * regions_.size() + std::max(a, b)]; }

 private:
  struct Seed {
    int cell;
    float roughness;  // root mean square residual of its window
    int bin;          // of depth
  };

  bool set_plane(PlaneRegion& region, double& rms) const;
  void count_contacts();
  void join_regions();
  void read(const EdgeField& field);
  void find_seeds();
  void estimate_error();
  double grow(int cell, uint16_t stamp, InversePlane& plane, int& count);
  bool is_thin(int cell, uint16_t stamp) const;
  bool window_sums(int column, int row, InversePlaneSums& sums) const;

  int step_ = 1, width_ = 0, height_ = 0;
  double focal_px_ = 1;
  std::vector<float> inverse_;  // of depth; 0: unknown
  std::vector<float> x_, y_;    // rays of columns and rows
  std::vector<uint8_t> labels_;
  std::vector<uint16_t> stamps_;
  std::vector<int> queue_;
  std::vector<Seed> seeds_;
  std::vector<PlaneRegion> regions_;
  std::vector<float> samples_;
  std::vector<int> contacts_;
  DepthError error_;
};

}  // namespace maq
