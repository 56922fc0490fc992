// How the networks see an image whose camera is rolled: whole, at their size, rotated upright by steps.
#pragma once

#include "image/crop_input.h"
#include "image/network_input.h"

namespace maq {

// Networks lose little by half of it; smaller steps would begin key frames more often.
constexpr double kRollStepRad = 15 * 3.14159265358979323846 / 180;

struct RotatedInput {
  NetworkSize size;    // without padding
  AffineMap to_image;  // from pixels of the input
  int roll_steps = 0;  // of kRollStepRad, by which the image was rotated
  Point up{0, -1};     // in the image, a unit vector
};

// Returns the input for an image that shows the world rotated clockwise by `roll_steps`. The longer side of the image
// becomes `long_side_px`; a rotated image keeps this scale, and the input is the bounding box of the rotated image.
RotatedInput rotated_input(int width_px, int height_px, int long_side_px, int roll_steps);

}  // namespace maq
