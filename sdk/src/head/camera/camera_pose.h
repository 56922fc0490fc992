// The camera of a photo from points of the head and the pixels where they are seen: robust PnP, float64.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "head/camera/head_camera.h"

namespace maq::head {

struct Correspondence {
  Vec3 point_dm;  // on the head
  double x_px = 0, y_px = 0;
  double sigma_px = 1;  // standard deviation of each coordinate; the shape's error belongs to it too
  double weight = 1;    // multiplies its squared residuals: less than 1 where neighbours say the same
};

struct CameraPoseOptions {
  double focal_px = 0;         // the prior's median
  double log_focal_sigma = 0;  // of the log-normal prior, 0..3; 0: the focal length is known
  double cx_px = 0, cy_px = 0;
  double min_inlier_fraction = 0.3;  // of the usable correspondences
};

enum class PoseStatus {
  kFound,
  kAmbiguous,     // another rotation explains the points almost as well: the better one is given
  kTooFewPoints,  // less than 4 usable correspondences
  kCollinear,     // the points do not determine the rotation: on a line, at one position, or too close for their noise
  kNoConsensus,   // no camera explains enough of them
  kMirrored,      // only a mirrored image fits, or a head behind the camera, which gives the same pixels
};

// A sentence for the photographer: the visible part of the head ("it").
const char* pose_status_text(PoseStatus status);

struct CameraPose {
  PoseStatus status = PoseStatus::kTooFewPoints;
  // With kFound and kAmbiguous only, as all below:
  HeadCamera camera;
  // 7x7, row by row: w (rad), t (dm), log focal, where the true camera is (exp_rotation(w) R, t0 + t, focal e^l); from
  // the sigmas of the inliers. The last row and column are 0 where the focal length is known.
  std::array<double, 49> covariance{};
  std::vector<char> is_inlier;  // of each correspondence: within 3.7 sigma (99.9 %)
  size_t inliers = 0;
  double rms_px = 0, rms_sigma = 0;  // of the inliers, per coordinate
  size_t unusable = 0;               // with any status: not finite, out of range, or with no positive weight and sigma
};

// Deterministic. Up to 60 % of the correspondences may be outliers, as long as more are left than chance would bring
// together: that takes some 20 points; of 10 points 30 % may be. Points with numbers that are not finite or beyond 1e6,
// or with a weight or sigma that is not positive, are left out and counted. All inliers lie in front of the camera.
// Throws MAQ_ERROR_INVALID_ARGUMENT unless the options are finite, the focal length positive, its sigma within 0..3 and
// the fraction within 0..1.
CameraPose find_camera_pose(const std::vector<Correspondence>& points, const CameraPoseOptions& options);

}  // namespace maq::head
