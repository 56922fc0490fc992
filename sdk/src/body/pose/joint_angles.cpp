#include "body/pose/joint_angles.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "core/error.h"

namespace maq::body {
namespace {

constexpr double kDegrees = 57.29577951308232;

size_t required_joint(const BodyModel& model, const std::string& name) {
  const int index = model.find_joint(name);
  if (index < 0) {
    throw Error(MAQ_ERROR_BAD_BUNDLE, "The body has no joint ", name,
                ", which its angles need. Export the bundle again.");
  }
  return size_t(index);
}

double flexion_deg(Vec3 start, Vec3 middle, Vec3 end) {
  const Vec3 upper = middle - start, lower = end - middle;
  return kDegrees * std::atan2(length(cross(upper, lower)), dot(upper, lower));
}

double sagittal_deg(const Mat3& orientation, Vec3 direction) {
  const Vec3 own = transposed(orientation) * direction;
  return own.y == 0 && own.z == 0 ? 0 : kDegrees * std::atan2(-own.y, -own.z);
}

}  // namespace

AngleJoints::AngleJoints(const BodyModel& model) : chest_(required_joint(model, "chest")) {
  for (size_t k = 0; k < 2; ++k) {
    const auto joint = [&](const char* name) {
      return required_joint(model, std::string(name) + (k == 0 ? ".L" : ".R"));
    };
    side_[k] = {joint("upper_arm"), joint("lower_arm"), joint("hand"),
                joint("upper_leg"), joint("lower_leg"), joint("foot")};
  }
}

std::array<double, kAngles> AngleJoints::angles_deg(const BodyBones& bones) const {
  std::array<double, kAngles> made{};
  for (size_t k = 0; k < 2; ++k) {
    const Side& side = side_[k];
    const auto& at = bones.place;
    made[k] = flexion_deg(at[side.shoulder], at[side.elbow], at[side.wrist]);
    made[2 + k] = flexion_deg(at[side.hip], at[side.knee], at[side.ankle]);
    made[4 + k] = sagittal_deg(bones.orientation[0], at[side.knee] - at[side.hip]);
    made[6 + k] = sagittal_deg(bones.orientation[chest_], at[side.elbow] - at[side.shoulder]);
  }
  return made;
}

}  // namespace maq::body
