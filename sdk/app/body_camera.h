// The camera that shows the body at rest (maq_densepose_surface), from far away.
#pragma once

#include <array>
#include <cmath>

namespace maquette {

struct BodyCamera {
  std::array<float, 16> projection;  // column by column, as OpenGL takes it
  std::array<float, 3> towards_eye;

  // From a direction, in radians, into a picture. The body stands on z = 0, faces -y and is under 2 m tall and wide.
  BodyCamera(float yaw, float pitch, int width, int height)
      : towards_eye{std::sin(yaw) * std::cos(pitch), -std::cos(yaw) * std::cos(pitch), std::sin(pitch)} {
    const std::array<float, 3> right{std::cos(yaw), std::sin(yaw), 0};
    const std::array<float, 3> up{-std::sin(yaw) * std::sin(pitch), std::cos(yaw) * std::sin(pitch), std::cos(pitch)};
    const float x = float(height) / float(width), middle = 0.85f;
    projection = {right[0] * x,
                  up[0],
                  -towards_eye[0] / 4,
                  0,
                  right[1] * x,
                  up[1],
                  -towards_eye[1] / 4,
                  0,
                  right[2] * x,
                  up[2],
                  -towards_eye[2] / 4,
                  0,
                  0,
                  -middle * up[2],
                  middle * towards_eye[2] / 4,
                  1};
  }
};

}  // namespace maquette
