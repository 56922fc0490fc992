// The joints of the template head on a fitted one: neck, head, jaw and eyes.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "core/math/vec3.h"
#include "head/head_template.h"
#include "head/registration/template_registration.h"

namespace maq::head {

struct TemplateJoint {
  std::string name;
  int parent = -1;  // an earlier joint; -1: none
  Vec3 position;    // dm, in the head's frame
};

struct TemplateJoints {
  std::vector<TemplateJoint> joints;          // Neck, Head, and, where the template has them, Jaw, LeftEye, RightEye
  std::vector<std::array<float, 5>> weights;  // of each point, by joint; the sum is 1
};

// The jaw turns about the axis of the facial action jawOpen: that of the teeth that it moves, or of all points that it
// moves if there are no such teeth. A point follows the jaw as far as jawOpen moves it along. Eyeballs turn about their
// middle, and are rigid. The neck bends between the neck's cut, which stays, and the skull.
TemplateJoints template_joints(const HeadTemplate& head, const TemplateRegistration& registration);

}  // namespace maq::head
