#include "body/pose/body_bones.h"

namespace maq::body {

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
