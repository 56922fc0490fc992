// The motion of one person as BVH (Biovision hierarchy), which animation programs read: a skeleton, and angles of its
// joints at an even rate.
#pragma once

#include <string>

#include "body/files/body_clip.h"

namespace maq::body {

// `person` has at least one pose. Lengths are in centimetres, x to the person's left, y up, z to the front; rotations
// are about z, then x, then y, in degrees. The rate is the mean rate of the poses; poses between two are interpolated.
std::string person_as_bvh(const BodyModel& model, const ClipPerson& person);

}  // namespace maq::body
