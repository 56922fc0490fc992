// Levenberg-Marquardt over the camera of points, in parameters that stay well conditioned without perspective.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "head/camera/se3.h"

namespace maq::head {

// A camera by what it does at the origin of the points, at depth z: N = (u, v) + s q_xy, pixel = N / (1 + q_z s / f),
// with q = R p and s = f / z. Far away, f leaves the equations and only its prior holds it, while u, v and s stay.
struct ScaledPose {
  Mat3 rotation = kIdentity3;
  double u_px = 0, v_px = 0;  // of the origin, from the principal point
  double log_scale = 0;       // of s, pixels a decimetre
  double log_focal = 0;
};

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

using PoseInformation = double[7][7];  // rotation (3), u, v, log scale, log focal

// Minimises sum weight * e / (1 + e / limit) + prior over the chosen points (Geman-McClure; `limit` in squared sigmas,
// INFINITY: least squares), at most `rounds` steps. Returns the cost, infinite where the start has a chosen point
// behind the camera and the limit is infinite. `information`, if given, gets the Gauss-Newton matrix at the end.
double refine_pose(ScaledPose& pose, const std::vector<PosePoint>& points, const size_t* chosen, size_t count,
                   const FocalPrior& prior, double limit, int rounds, PoseInformation* information = nullptr);

}  // namespace maq::head
