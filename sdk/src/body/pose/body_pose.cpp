#include "body/pose/body_pose.h"

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

}  // namespace maq::body
