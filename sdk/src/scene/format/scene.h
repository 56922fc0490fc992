// A scene as it is rendered and stored: points in blocks of neighbours, with their descriptors.
//
// A descriptor is a constant term plus, for view-dependent points, linear coefficients of the view basis
// (descriptor.h). Points are split into blocks of neighbours (scene_blocks.h), so that a block is a small box: it is
// culled whole where a camera does not see it, and positions need 16 bits a coordinate. In each block the
// view-dependent points come first; the rest have no linear terms. Arrays are owned or lie in a mapped file; the
// renderer does not know which.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "scene/descriptor.h"

namespace maq {

enum class PositionFormat : uint8_t { kFloat32, kUint16 };
enum class CoefficientFormat : uint8_t { kFloat32, kInt16, kInt8 };

struct SceneBlock {
  static constexpr uint32_t kMaxPoints = 1024;
  uint32_t first = 0;                             // of its points, counted over the scene
  uint32_t count = 0;                             // 1 .. kMaxPoints
  uint32_t view_dependent = 0;                    // so many, the first, have linear terms
  uint32_t first_view_dependent = 0;              // of those, counted over the scene
  float low[3] = {0, 0, 0}, high[3] = {0, 0, 0};  // bounds, relative to the scene's origin
  // A stored coordinate q is low + q * position_step (kUint16); a float is relative to the scene's origin, step unused.
  float position_step[3] = {0, 0, 0};
  // A stored constant term q is constant_middle + q * constant_step, a linear one q * linear_step; 0 and 1 for floats.
  float constant_middle[kFeatures] = {}, constant_step[kFeatures] = {};
  float linear_step[kBasis * kFeatures] = {};
};

struct Scene {
  std::array<double, 3> origin = {0, 0, 0};
  std::array<double, 3> up = {0, 0, 1};
  std::array<float, 3> background = {0, 0, 0};  // red, green, blue of pixels without points, 0..1
  PositionFormat position_format = PositionFormat::kFloat32;
  CoefficientFormat coefficient_format = CoefficientFormat::kFloat32;
  uint32_t points = 0, view_dependent = 0;
  uint32_t block_count = 0;
  const SceneBlock* blocks = nullptr;
  // For a block of points [first, first + count): x of all, then y, then z, from positions + 3 * first elements on.
  const void* positions = nullptr;
  const void* constant_terms = nullptr;          // [points][kFeatures]
  const void* linear_terms = nullptr;            // [view_dependent][kBasis][kFeatures]
  std::array<uint8_t, 32> networks_sha256 = {};  // of the networks that the descriptors are for (scene_networks.h)
  std::shared_ptr<const void> owner;             // of the arrays: vectors or a mapping
};

// The box of all points, in the world.
struct SceneBounds {
  std::array<double, 3> low, high;
};
SceneBounds bounds_of(const Scene& scene);

// Bytes of one number, and of the scene's arrays.
inline size_t size_bytes_of(PositionFormat format) {
  return format == PositionFormat::kFloat32 ? sizeof(float) : sizeof(uint16_t);
}
inline size_t size_bytes_of(CoefficientFormat format) {
  return format == CoefficientFormat::kFloat32 ? sizeof(float)
         : format == CoefficientFormat::kInt16 ? sizeof(int16_t)
                                               : sizeof(int8_t);
}
inline size_t blocks_bytes(const Scene& scene) { return size_t(scene.block_count) * sizeof(SceneBlock); }
inline size_t positions_bytes(const Scene& scene) {
  return size_t(scene.points) * 3 * size_bytes_of(scene.position_format);
}
inline size_t constant_terms_bytes(const Scene& scene) {
  return size_t(scene.points) * kFeatures * size_bytes_of(scene.coefficient_format);
}
inline size_t linear_terms_bytes(const Scene& scene) {
  return size_t(scene.view_dependent) * kLinearTerms * size_bytes_of(scene.coefficient_format);
}

// Finds the block of a point.
class BlockIndex {
 public:
  explicit BlockIndex(const Scene& scene) : blocks_(scene.blocks) {
    for (uint32_t block = 0; block < scene.block_count; ++block) {
      // The first block that begins in or before each chunk, and ends behind its begin.
      const uint32_t end = blocks_[block].first + blocks_[block].count;
      while (uint64_t(chunks_.size()) << kChunkBits < end) chunks_.push_back(block);
    }
  }

  // Full blocks are found in at most two steps; the smallest in as many as a chunk has points.
  uint32_t block_of(uint32_t point) const {
    uint32_t block = chunks_[point >> kChunkBits];
    while (point - blocks_[block].first >= blocks_[block].count) ++block;
    return block;
  }

 private:
  static constexpr uint32_t kChunkBits = 8;
  const SceneBlock* blocks_;
  std::vector<uint32_t> chunks_;
};

}  // namespace maq
