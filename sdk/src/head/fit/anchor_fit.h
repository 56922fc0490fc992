// Stage 0 of a fit: cameras and shape codes from the encoder's template points alone, in milliseconds.
#pragma once

#include <vector>

#include "head/camera/camera_pose.h"
#include "head/fit/anchor_terms.h"
#include "head/fit/observations.h"
#include "head/head_prior.h"

namespace maq::head {

// With the terms of AnchorTermOptions, N(0, 1) for each code and the photo's prior for its focal length.
struct AnchorFitOptions {
  AnchorTermOptions terms;
  // Minimum fraction of a photo's cells that agree with the head of all photos. A photo with fewer shows no head, or
  // the head of another person.
  double min_inlier_fraction = 0.3;
  int max_steps = 16;  // of Levenberg-Marquardt
};

struct PhotoFit {
  // kFound, kAmbiguous: the photo has part in the fit, and what is below `cells` is set. kNoConsensus may also mean
  // that it shows another head than the other photos.
  PoseStatus status = PoseStatus::kTooFewPoints;
  size_t cells = 0;  // that could be used
  HeadCamera camera;
  size_t inliers = 0;
  double rms_px = 0, rms_sigma = 0;  // of these, per coordinate

  bool is_used() const { return status == PoseStatus::kFound || status == PoseStatus::kAmbiguous; }
};

struct AnchorFit {
  // Codes of the mean head if no photo is used.
  std::vector<float> shape_codes;
  std::vector<float> code_sigmas;      // their standard deviations after all; 1: the photos say nothing of it
  std::vector<float> code_covariance;  // [codes][codes]; the identity where the photos say nothing
  std::vector<PhotoFit> photos;        // as they were given
  int steps = 0;
  double cost = 0;  // twice the negative log of the posterior

  size_t used() const;
  bool is_found() const { return used() > 0; }
};

// One head, seen in one or more photos. Deterministic. About linear in the number of cells; the codes squared and the
// photos are in the equations. Throws MAQ_ERROR_INVALID_ARGUMENT for no photos or more than kMaxFitPhotos, and the
// errors of find_camera_pose() for the known values of a camera.
inline constexpr size_t kMaxFitPhotos = 64;
AnchorFit fit_anchors(const HeadPrior& prior, const std::vector<HeadPhoto>& photos,
                      const AnchorFitOptions& options = {});

}  // namespace maq::head
