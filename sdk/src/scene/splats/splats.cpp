#include "scene/splats/splats.h"

#include <algorithm>
#include <cmath>

#include "core/math/finite.h"

namespace maq {
namespace {

// Squares and products of a few of these are floats.
constexpr double kMaxSplatPosition = 1e12;
constexpr float kMaxSplatScale = 1e9f;

}  // namespace

void Splats::reserve(size_t count) {
  position.reserve(3 * count);
  scale.reserve(3 * count);
  rotation.reserve(4 * count);
  opacity.reserve(count);
  colour.reserve(3 * count);
  sh.reserve(3 * size_t(sh_terms(sh_degree)) * count);
}

bool Splats::add(const Splat& splat) {
  for (const double value : splat.position) {
    if (!(std::abs(value) <= kMaxSplatPosition)) return false;
  }
  for (const float value : splat.scale) {
    if (!(value >= 0 && value <= kMaxSplatScale)) return false;
  }
  double length = 0;
  for (const float value : splat.rotation) length += double(value) * double(value);
  length = std::sqrt(length);
  if (!(length > 1e-12 && length < 1e12) || !(splat.opacity >= 0 && splat.opacity <= 1) ||
      !are_finite(splat.colour.data(), 3)) {
    return false;
  }
  if (opacity.empty()) origin = splat.position;
  for (size_t axis = 0; axis < 3; ++axis) position.push_back(float(splat.position[axis] - origin[axis]));
  scale.insert(scale.end(), splat.scale.begin(), splat.scale.end());
  for (const float value : splat.rotation) rotation.push_back(float(double(value) / length));
  opacity.push_back(splat.opacity);
  for (const float value : splat.colour) colour.push_back(std::clamp(value, -8.0f, 8.0f));
  return true;
}

int16_t sh_steps(double coefficient) {
  if (std::isnan(coefficient)) return 0;
  return int16_t(std::lround(std::clamp(coefficient / double(kShStep), -32767.0, 32767.0)));
}

Splat splat_at(const Splats& splats, size_t index) {
  Splat splat;
  for (size_t k = 0; k < 3; ++k) {
    splat.position[k] = splats.origin[k] + double(splats.position[3 * index + k]);
    splat.scale[k] = splats.scale[3 * index + k];
    splat.colour[k] = splats.colour[3 * index + k];
  }
  for (size_t k = 0; k < 4; ++k) splat.rotation[k] = splats.rotation[4 * index + k];
  splat.opacity = splats.opacity[index];
  return splat;
}

std::array<std::array<double, 3>, 2> bounds_of(const Splats& splats) {
  std::array<std::array<double, 3>, 2> box = {splats.origin, splats.origin};
  for (size_t i = 0; i < splats.position.size(); ++i) {
    const size_t axis = i % 3;
    const double value = splats.origin[axis] + double(splats.position[i]);
    box[0][axis] = i < 3 ? value : std::min(box[0][axis], value);
    box[1][axis] = i < 3 ? value : std::max(box[1][axis], value);
  }
  return box;
}

}  // namespace maq
