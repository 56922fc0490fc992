// How points of a scene look from one side, from the coefficients as they are stored.
#pragma once

#include <cstdint>

#include "scene/format/scene.h"

namespace maq {

// A point of a scene, and where its look goes.
struct PointToShade {
  uint32_t block, point;  // the latter counted in the block
  float* to;              // kFeatures values, then 1
};

// Points that are worked on together.
inline constexpr size_t kShadedAtOnce = 64;

// Asks for what the look of the points needs, which may lie anywhere in memory, before its turn.
void fetch(const Scene& scene, const PointToShade* points, size_t count, bool with_slopes);

// Unit vectors from a camera's centre to at most kShadedAtOnce points, one array for each coordinate; 0 for a point in it.
void find_directions(const Scene& scene, const std::array<double, 3>& camera_centre, const PointToShade* points,
                     size_t count, float* x, float* y, float* z);

// Writes the looks of points: the mean, plus `basis` [kBasis][count] times the slopes where it is not null.
void decode_looks(const Scene& scene, const PointToShade* points, size_t count, const float* basis);

}  // namespace maq
