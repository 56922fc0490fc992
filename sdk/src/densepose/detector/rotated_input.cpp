#include "densepose/detector/rotated_input.h"

#include <algorithm>
#include <cmath>

namespace maq {

RotatedInput rotated_input(int width_px, int height_px, int long_side_px, int roll_steps) {
  RotatedInput input;
  input.roll_steps = roll_steps;
  input.size = network_size(width_px, height_px, long_side_px);
  input.to_image.xx = double(width_px) / input.size.width_px;
  input.to_image.yy = double(height_px) / input.size.height_px;
  if (roll_steps == 0) return input;
  const double angle = roll_steps * kRollStepRad;
  const double cos = std::cos(angle), sin = std::sin(angle);
  const double scale = long_side_px / double(std::max(width_px, height_px));
  const auto side = [&](double along, double across) {
    return std::max(1, int(std::ceil(scale * (along * std::abs(cos) + across * std::abs(sin)) - 1e-6)));
  };
  input.size = {side(width_px, height_px), side(height_px, width_px)};
  AffineMap& map = input.to_image;
  map.xx = map.yy = cos / scale;
  map.xy = -sin / scale;
  map.yx = sin / scale;
  const double middle_x = input.size.width_px / 2.0, middle_y = input.size.height_px / 2.0;
  map.shift_x = width_px / 2.0 - map.xx * middle_x - map.xy * middle_y;
  map.shift_y = height_px / 2.0 - map.yx * middle_x - map.yy * middle_y;
  input.up = {sin, -cos};
  return input;
}

}  // namespace maq
