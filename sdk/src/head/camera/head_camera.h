// The camera of an image of a head.
#pragma once

#include "head/camera/se3.h"

namespace maq::head {

// x right, y down, z forward; pixel = focal_px * (x, y) / z + (cx_px, cy_px), the centre of the first pixel is (0, 0).
struct HeadCamera {
  RigidMotion head_to_camera;  // decimetres
  double focal_px = 0, cx_px = 0, cy_px = 0;
  int width_px = 0, height_px = 0;  // of the image; 0 if it does not matter
};

}  // namespace maq::head
