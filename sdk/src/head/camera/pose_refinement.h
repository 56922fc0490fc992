// Levenberg-Marquardt over the camera of points.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "head/camera/scaled_pose.h"

namespace maq::head {

struct PosePoint {
  Vec3 p;       // from the origin, decimetres
  double x, y;  // from the principal point, pixels
  double sigma_px, weight;
};

struct FocalPrior {
  double log_mean = 0, sigma = 0;  // 0: fixed
};

// The squared residual of both coordinates in sigmas; infinite at or behind the camera's plane.
double squared_error(const ScaledPose& pose, const PosePoint& point);

using PoseInformation = double[kPoseUnknowns][kPoseUnknowns];

// Minimises sum weight * e / (1 + e / limit) + prior over the chosen points (Geman-McClure; `limit` in squared sigmas,
// INFINITY: least squares), at most `rounds` steps. Returns the cost, infinite where the start has a chosen point
// behind the camera and the limit is infinite. `information`, if given, gets the Gauss-Newton matrix at the end.
double refine_pose(ScaledPose& pose, const std::vector<PosePoint>& points, const size_t* chosen, size_t count,
                   const FocalPrior& prior, double limit, int rounds, PoseInformation* information = nullptr);

}  // namespace maq::head
