// How well a camera and shape codes explain at which pixels the points of the template head are seen.
#pragma once

#include <cstddef>
#include <vector>

#include "head/camera/camera_pose.h"
#include "head/camera/scaled_pose.h"
#include "head/fit/anchor_points.h"
#include "head/fit/observations.h"

namespace maq::head {

// The noise of a cell: of its template point (the encoder's sigma) and of the anchors near it, in decimetres, and of
// the pixel. Each cell's squared error e, in sigmas, costs e / (1 + e / limit) (Geman-McClure).
struct AnchorTermOptions {
  size_t max_cells = 1000;  // of a photo, spread evenly over the usable ones
  double min_matte = 0.5;
  double cell_weight = 0.15;   // of a cell's cost: neighbours say the same
  double pixel_sigma = 0.3;    // of where in its cell the encoder saw the point, in cells
  double limit = 9;            // in squared sigmas
  double max_anchor_dm = 0.5;  // cells that see a point farther than this from all anchors are left out
  // If the face has a second pass, the first pass counts only around it and in this border, in cells.
  double face_border = 1;
};

// The costs of one photo. The pose's origin is the origin of the head's frame.
class AnchorTerms {
 public:
  AnchorTerms(const HeadPhoto& photo, const AnchorPoints& points, const AnchorTermOptions& options);

  size_t cells() const { return cells_.size(); }
  size_t codes() const { return codes_; }
  int unknowns() const { return kPoseUnknowns + int(codes_); }

  // For find_camera_pose(): points of the head with codes of 0, whose own sigma is part of theirs.
  std::vector<Correspondence> correspondences() const;

  // Takes the noise in pixels as this camera sees it, and holds it until the next call. `code_fraction`: of the
  // variance of the codes a priori, which widens the limit, so that cells far off for their codes alone are still
  // heard.
  void set_noise(const ScaledPose& pose, const double* codes, double code_fraction);

  // The sum of cell_weight * loss, which is twice a negative log likelihood. Infinite where a cell is not seen.
  double cost(const ScaledPose& pose, const double* codes) const;

  // Adds J'WJ to the lower triangle of `a` [unknowns][unknowns] and J'W (observed - seen) to `b`: pose, then codes.
  void accumulate(const ScaledPose& pose, const double* codes, double* a, double* b);

  // Half the cost; adds its gradient by the pose [kPoseUnknowns] and the codes, both times `weight`.
  double gradient(const ScaledPose& pose, const double* codes, double weight, double* by_pose, double* by_codes) const;

  // How many cells are within 3.7 sigma (99.9 %), and their errors.
  struct Agreement {
    size_t inliers = 0;
    double rms_px = 0, rms_sigma = 0;  // of the inliers, per coordinate
  };
  Agreement agreement(const ScaledPose& pose, const double* codes) const;

 private:
  struct Cell {
    Vec3 mean;
    double x_px, y_px;  // from the principal point
    double sigma_dm, code_variance, pixel_sigma_px;
    double inverse_variance, limit;  // set_noise()
  };
  struct Residual {
    SeenPoint at;
    double x, y;   // observed - seen, px
    double error;  // squared, in sigmas
  };
  Vec3 point(size_t cell, const double* codes) const;
  Residual residual(size_t cell, const ScaledProjection& projection, const double* codes) const;

  size_t codes_;
  double cell_weight_, limit_, cx_px_, cy_px_;
  std::vector<Cell> cells_;
  std::vector<double> linear_;  // [cells][3][codes]
  std::vector<double> rows_;    // [2 cells][unknowns], of accumulate()
};

}  // namespace maq::head
