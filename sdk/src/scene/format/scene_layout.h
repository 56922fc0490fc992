// How large the arrays of a scene are.
#pragma once

#include <cstddef>

#include "scene/format/scene.h"

namespace maq {

inline constexpr size_t kSlopes = size_t(kBasis) * kFeatures;

// What one number takes.
inline size_t size_bytes_of(Places kind) { return kind == Places::kFloat32 ? sizeof(float) : sizeof(uint16_t); }
inline size_t size_bytes_of(Coefficients kind) {
  return kind == Coefficients::kFloat32 ? sizeof(float) : kind == Coefficients::kInt16 ? sizeof(int16_t) : 1;
}

inline size_t blocks_bytes(const Scene& scene) { return size_t(scene.block_count) * sizeof(SceneBlock); }
inline size_t places_bytes(const Scene& scene) { return size_t(scene.points) * 3 * size_bytes_of(scene.place_kind); }
inline size_t means_bytes(const Scene& scene) {
  return size_t(scene.points) * kFeatures * size_bytes_of(scene.coefficient_kind);
}
inline size_t slopes_bytes(const Scene& scene) {
  return size_t(scene.varying) * kSlopes * size_bytes_of(scene.coefficient_kind);
}

}  // namespace maq
