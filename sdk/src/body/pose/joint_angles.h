// Angles of the usual joints, as people who measure movement name them.
#pragma once

#include <array>

#include "body/pose/body_bones.h"

namespace maq::body {

// Pairs of left and right, in the order of maq_body_angle.
inline constexpr size_t kAngles = 8;

// The joints that the angles need, by name. Throws MAQ_ERROR_BAD_BUNDLE for a model without one of them.
class AngleJoints {
 public:
  explicit AngleJoints(const BodyModel& model);

  // Degrees: elbow, knee, hip and shoulder flexion, each left and right. Elbow and knee: 0 straight, 0 to 180. Hip and
  // shoulder: of the limb's direction projected to the sagittal plane of pelvis or chest: 0 hanging down, 90 to the
  // front, negative to the back, -180 to 180.
  std::array<double, kAngles> angles_deg(const BodyBones& bones) const;

 private:
  struct Side {
    size_t shoulder, elbow, wrist, hip, knee, ankle;
  };
  std::array<Side, 2> side_;
  size_t chest_;
};

}  // namespace maq::body
