// Rays through an image's pixels in the head's frame, and how their points move with the camera.
#pragma once

#include <cmath>

#include "head/camera/scaled_pose.h"

namespace maq::head {

// A point of a ray is given by how much deeper than the head's origin it lies (dm, along the optical axis): at the same
// depth it stays with the head where the camera comes nearer.
class PoseRays {
 public:
  explicit PoseRays(const ScaledPose& pose)
      : pose_(pose),
        back_(transposed(pose.rotation)),
        decimetres_(std::exp(-pose.log_scale)),
        ratio_(std::exp(pose.log_scale - pose.log_focal)),
        inverse_focal_(std::exp(-pose.log_focal)) {}

  const Mat3& rotation() const { return pose_.rotation; }
  // Where the camera is: nothing is seen that is not deeper.
  double eye_depth() const { return -1 / ratio_; }

  // Pixels are from the principal point. point = base + depth * direction.
  Vec3 base(double x_px, double y_px) const {
    return back_ * Vec3{(x_px - pose_.u_px) * decimetres_, (y_px - pose_.v_px) * decimetres_, 0};
  }
  Vec3 direction(double x_px, double y_px) const {
    return back_ * Vec3{x_px * inverse_focal_, y_px * inverse_focal_, 1};
  }

  // Adds the gradient by the pose of what has this gradient by the ray's point at this depth.
  void add_gradient(double x_px, double y_px, double depth, Vec3 by_point, double* by_pose) const {
    const Vec3 g = pose_.rotation * by_point;
    const double deeper = depth * ratio_;  // the depth ratio less 1
    const Vec3 r = {(x_px * (1 + deeper) - pose_.u_px) * decimetres_, (y_px * (1 + deeper) - pose_.v_px) * decimetres_,
                    depth};
    const Vec3 turn = cross(g, r);
    by_pose[0] += turn.x, by_pose[1] += turn.y, by_pose[2] += turn.z;
    by_pose[3] -= g.x * decimetres_, by_pose[4] -= g.y * decimetres_;
    by_pose[5] += decimetres_ * (g.x * (pose_.u_px - x_px) + g.y * (pose_.v_px - y_px));
    by_pose[6] -= decimetres_ * deeper * (g.x * x_px + g.y * y_px);
  }

 private:
  ScaledPose pose_;
  Mat3 back_;
  double decimetres_, ratio_, inverse_focal_;  // decimetres a pixel, at the origin
};

}  // namespace maq::head
