// The bones of a body in a pose: forward kinematics and skinning.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "body/pose/body_pose.h"

namespace maq::body {

// Everything in camera axes, metres, from the first joint.
struct BodyBones {
  std::array<Mat3, kMaxJoints> orientation;  // body axes to camera axes
  std::array<Vec3, kMaxJoints> place;        // of the joint
  std::array<Vec3, kMaxJoints> rest;         // of the joint in the body's shape, body axes
  std::array<double, kMaxShapes> shape{};
};

BodyBones bones_of(const BodyModel& model, const BodyPose& pose);

// The rest position of a point in the shape, body axes.
Vec3 shaped(const Vec3& rest, const ShapeVectors& basis, const std::array<double, kMaxShapes>& shape, size_t count);

// Where the bone of a joint takes a rest position.
inline Vec3 moved(const BodyBones& bones, size_t joint, Vec3 rest) {
  return bones.orientation[joint] * (rest - bones.rest[joint]) + bones.place[joint];
}

// Linear blend skinning of a vertex or a keypoint.
Vec3 posed(const BodyModel& model, const BodyBones& bones, const BodyPoint& point);

}  // namespace maq::body
