#include "body/pose/body_bones.h"

#include <algorithm>
#include <cmath>

namespace maq::body {

BodyPose mean_pose(const BodyModel& model) {
  BodyPose pose;
  for (size_t j = 1; j < model.joints.size(); ++j) {
    const double* const mean = model.prior.mean.data() + 3 * (j - 1);
    pose.rotation[j] = {mean[0], mean[1], mean[2]};
  }
  return pose;
}

bool is_finite(const BodyPose& pose, size_t joints) {
  const auto is_number = [](double value) { return std::isfinite(value); };
  const auto is_point = [](Vec3 value) { return maq::is_finite(value); };
  return std::all_of(pose.orientation.begin(), pose.orientation.end(), is_number) && maq::is_finite(pose.place) &&
         std::all_of(pose.rotation.begin() + 1, pose.rotation.begin() + std::ptrdiff_t(joints), is_point) &&
         std::all_of(pose.shape.begin(), pose.shape.end(), is_number);
}

Vec3 shaped(const Vec3& rest, const ShapeVectors& basis, const std::array<double, kMaxShapes>& shape, size_t count) {
  Vec3 point = rest;
  for (size_t s = 0; s < count; ++s) point = point + shape[s] * basis[s];
  return point;
}

BodyBones bones_of(const BodyModel& model, const BodyPose& pose) {
  BodyBones bones;
  bones.shape = pose.shape;
  for (size_t j = 0; j < model.joints.size(); ++j) {
    const BodyJoint& joint = model.joints[j];
    bones.rest[j] = shaped(joint.rest, joint.basis, pose.shape, model.shape_count);
    if (j == 0) {
      bones.orientation[0] = pose.orientation;
      bones.place[0] = {};
      continue;
    }
    const auto parent = size_t(joint.parent);
    bones.orientation[j] = bones.orientation[parent] * exp_rotation(pose.rotation[j]);
    bones.place[j] = moved(bones, parent, bones.rest[j]);
  }
  return bones;
}

Vec3 posed(const BodyModel& model, const BodyBones& bones, const BodyPoint& point) {
  const Vec3 rest = shaped(point.rest, point.basis, bones.shape, model.shape_count);
  Vec3 sum;
  for (size_t k = 0; k < kWeights; ++k) {
    if (point.weights[k] > 0) sum = sum + point.weights[k] * moved(bones, point.joints[k], rest);
  }
  return sum;
}

}  // namespace maq::body
