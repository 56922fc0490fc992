// A body in a shape and a pose, before a camera.
#pragma once

#include <array>

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

}  // namespace maq::body
