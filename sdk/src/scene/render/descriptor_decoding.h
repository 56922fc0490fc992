// Descriptors of points for one viewing direction, from the coefficients as they are stored.
#pragma once

#include <cstdint>

#include "scene/format/scene.h"

namespace maq {

// A point of a scene, and where its descriptor goes.
struct PointToShade {
  uint32_t block, point;  // the latter counted in the block
  float* to;              // kFeatures values, then 1
};

// Points that are shaded together.
inline constexpr size_t kShadedAtOnce = 64;

// Prefetches the data of the points' descriptors, which may lie anywhere in memory.
void prefetch(const Scene& scene, const PointToShade* points, size_t count, bool with_linear_terms);

// Unit vectors from a camera's centre to at most kShadedAtOnce points, one array for each coordinate; 0 for a point in
// it.
void find_directions(const Scene& scene, const std::array<double, 3>& camera_centre, const PointToShade* points,
                     size_t count, float* x, float* y, float* z);

// Writes the descriptors of points: the constant term, and unless `basis` [kBasis][count] is null the linear terms
// times it.
void decode_descriptors(const Scene& scene, const PointToShade* points, size_t count, const float* basis);

}  // namespace maq
