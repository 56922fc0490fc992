// Bodies as glTF 2.0 in one file: a skin for each person, and an animation if there is more than one frame.
#pragma once

#include <cstdint>
#include <vector>

#include "body/files/body_clip.h"

namespace maq::body {

// `people` has at least one, each with at least one pose.
std::vector<uint8_t> people_as_glb(const BodyModel& model, const std::vector<const ClipPerson*>& people);

}  // namespace maq::body
