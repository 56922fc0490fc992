// A camera without lens distortion, in the convention of OpenCV: x to the right, y down, z forward.
#pragma once

#include <array>
#include <cstdint>

#include "image/geometry/intrinsics.h"

namespace maq {

struct PinholeCamera : Intrinsics {
  std::array<double, 9> rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1};  // row by row: world to camera
  std::array<double, 3> centre = {0, 0, 0};                      // in the world
};

// Throws MAQ_ERROR_INVALID_ARGUMENT unless every number is finite, the focal lengths are positive, the size is allowed
// and the rotation is one to within 1e-3. `what` begins the sentence.
void check_camera(const PinholeCamera& camera, const char* what);

}  // namespace maq
