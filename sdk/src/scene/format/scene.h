// A scene as it is rendered and stored: points in blocks of neighbours, with their looks.
//
// Points are cut into blocks of neighbours (scene_blocks.h), so that a block is a small box: it can be left out whole where
// a camera does not see it, and places need 16 bits a coordinate. In each block the points whose look depends on the side
// come first; the rest have no slopes. Arrays are owned or lie in a mapped file; the renderer does not know which.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>

#include "scene/build/descriptor_regression.h"

namespace maq {

enum class Places : uint8_t { kFloat32, kUint16 };
enum class Coefficients : uint8_t { kFloat32, kInt16, kInt8 };

struct SceneBlock {
  static constexpr uint32_t kMostPoints = 1024;
  uint32_t first = 0;                             // of its points, counted over the scene
  uint32_t count = 0;                             // 1 .. kMostPoints
  uint32_t varying = 0;                           // the first so many have slopes
  uint32_t first_varying = 0;                     // of those, counted over the scene
  float low[3] = {0, 0, 0}, high[3] = {0, 0, 0};  // bounds, relative to the scene's origin
  // A stored place q is low + q * place_step (kUint16); a float is relative to the scene's origin, and step unused.
  float place_step[3] = {0, 0, 0};
  // A stored mean q is mean_middle + q * mean_step, a slope q * slope_step; 0 and 1 for floats.
  float mean_middle[kFeatures] = {}, mean_step[kFeatures] = {};
  float slope_step[kBasis * kFeatures] = {};
};

struct Scene {
  std::array<double, 3> origin = {0, 0, 0};
  std::array<double, 3> up = {0, 0, 1};
  std::array<float, 3> background = {0, 0, 0};  // red, green, blue of what has no points, 0..1
  Places place_kind = Places::kFloat32;
  Coefficients coefficient_kind = Coefficients::kFloat32;
  uint32_t points = 0, varying = 0;
  uint32_t block_count = 0;
  const SceneBlock* blocks = nullptr;
  // For a block at points [first, first + count): x of all, then y, then z, from places + 3 * first elements on.
  const void* places = nullptr;
  const void* means = nullptr;                   // [points][kFeatures]
  const void* slopes = nullptr;                  // [varying][kBasis][kFeatures]
  std::array<uint8_t, 32> networks_sha256 = {};  // of the networks that the looks were made with (see scene_networks.h)
  std::shared_ptr<const void> owner;             // of the arrays: vectors or a mapping
};

}  // namespace maq
