// A camera in parameters that stay well conditioned without perspective, and how pixels change with them.
#pragma once

#include <cmath>

#include "head/camera/head_camera.h"

namespace maq::head {

// A camera by its projection at an origin within the points, at depth z: N = (u, v) + s q_xy, pixel = N / (1 + q_z s /
// f), with q = R (p - origin) and s = f / z. Far away, f leaves the equations and only its prior holds it, while u, v
// and s stay.
struct ScaledPose {
  Mat3 rotation = kIdentity3;
  double u_px = 0, v_px = 0;  // of the origin, from the principal point
  double log_scale = 0;       // of s, pixels a decimetre
  double log_focal = 0;
};

inline constexpr int kPoseUnknowns = 7;         // rotation (3), u, v, log scale, log focal
inline constexpr double kMinDepthRatio = 1e-3;  // of the depth at the origin: nearer points are not visible

// The derivatives of a pixel.
struct PixelJacobian {
  double by_pose[2][kPoseUnknowns];
  double by_turned[2][3];  // by R (p - origin)
};

struct SeenPoint {
  Vec3 turned;         // R (p - origin)
  double depth_ratio;  // of its depth to the depth of the origin
  double x_px, y_px;   // from the principal point

  bool is_seen() const { return depth_ratio > kMinDepthRatio; }
};

class ScaledProjection {
 public:
  explicit ScaledProjection(const ScaledPose& pose)
      : pose_(pose), scale_(std::exp(pose.log_scale)), ratio_(std::exp(pose.log_scale - pose.log_focal)) {}

  // Projects a point that is given relative to the origin.
  SeenPoint project(Vec3 p) const {
    const Vec3 q = pose_.rotation * p;
    const double w = 1 + q.z * ratio_;
    return {q, w, (pose_.u_px + scale_ * q.x) / w, (pose_.v_px + scale_ * q.y) / w};
  }

  PixelJacobian jacobian(const SeenPoint& at) const {
    const double s = scale_, k = ratio_, by_w = 1 / at.depth_ratio;
    const Vec3 q = at.turned;
    // Derivatives of the pixel by q: (s, 0, -x k) and (0, s, -y k), over the depth ratio; of q by the rotation: -[q]x.
    const double xz = -at.x_px * k, yz = -at.y_px * k, deeper = (at.depth_ratio - 1) * by_w;
    return {{{by_w * xz * q.y, by_w * (s * q.z - xz * q.x), by_w * -s * q.y, by_w, 0, by_w * s * q.x - at.x_px * deeper,
              at.x_px * deeper},
             {by_w * (yz * q.y - s * q.z), by_w * -yz * q.x, by_w * s * q.x, 0, by_w, by_w * s * q.y - at.y_px * deeper,
              at.y_px * deeper}},
            {{by_w * s, 0, by_w * xz}, {0, by_w * s, by_w * yz}}};
  }

  double scale() const { return scale_; }  // pixels a decimetre, at the origin

 private:
  ScaledPose pose_;
  double scale_, ratio_;
};

// The pose after a step of its unknowns.
inline ScaledPose moved(const ScaledPose& pose, const double* step) {
  ScaledPose to = pose;
  to.rotation = exp_rotation({step[0], step[1], step[2]}) * pose.rotation;
  to.u_px += step[3], to.v_px += step[4];
  to.log_scale += step[5], to.log_focal += step[6];
  return to;
}

// A rotation of more than a radian, or a scale of more than e^2, is outside of the range of a step's equations. False
// for NaN.
inline bool is_small_step(const double* step) {
  return std::sqrt(step[0] * step[0] + step[1] * step[1] + step[2] * step[2]) < 1 && std::abs(step[5]) < 2 &&
         std::abs(step[6]) < 2;
}

inline HeadCamera camera_of(const ScaledPose& pose, Vec3 origin, double cx_px, double cy_px) {
  const double s = std::exp(pose.log_scale);
  const Vec3 at = {pose.u_px / s, pose.v_px / s, std::exp(pose.log_focal - pose.log_scale)};
  return {{pose.rotation, at - pose.rotation * origin}, std::exp(pose.log_focal), cx_px, cy_px};
}

// For a camera with the origin in front of it.
inline ScaledPose scaled_pose_of(const HeadCamera& camera, Vec3 origin) {
  const Vec3 at = camera.head_to_camera * origin;
  const double s = camera.focal_px / at.z;
  return {camera.head_to_camera.rotation, s * at.x, s * at.y, std::log(s), std::log(camera.focal_px)};
}

}  // namespace maq::head
