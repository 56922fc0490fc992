// A body in a shape and a pose before a camera, and its bones: forward kinematics and skinning.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "body/model/body_model.h"
#include "core/math/rotation.h"

namespace maq::body {

// The orientation of a person who stands upright and looks into the camera: camera axes are x right, y down, z forward.
inline constexpr Mat3 kFacing = {1, 0, 0, 0, 0, -1, 0, 1, 0};

struct BodyPose {
  Mat3 orientation = kFacing;              // of the first joint's bones: body axes to camera axes
  Vec3 place;                              // of the first joint, as the camera's kind has it (body_camera.h)
  std::array<Vec3, kMaxJoints> rotation;   // rotation vector of each joint relative to its parent; [0] is not used
  std::array<double, kMaxShapes> shape{};  // standard deviations
};

// The mean pose of the prior in the mean shape, facing the camera.
BodyPose mean_pose(const BodyModel& model);

// Whether every number of the pose is finite.
bool is_finite(const BodyPose& pose, size_t joints);

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
