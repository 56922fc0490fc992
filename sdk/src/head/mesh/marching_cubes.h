// The surface of a signed distance as a mesh: marching cubes in the cells that the distance cannot exclude.
//
// The mesh is closed and manifold whatever the field is, and its triangles have an area: corners of value 0 count as
// outside, vertices keep off the grid's corners by kMinFraction of a cell, the table is in cube_triangles.h, and a
// surface that leaves the box is closed along the box. Where the field is steeper than it is said to be, a piece of the
// surface can be missed, but none is left open: cells are added wherever the surface goes on.
#pragma once

#include <array>
#include <cstddef>
#include <functional>

#include "core/worker_threads.h"
#include "head/mesh/head_mesh.h"

namespace maq::head {

// Writes the field's value at each of `count` points to `values`; negative is inside. Called by several threads at once
// where there are several, each time for at most kFieldBatch points.
using ScalarField = std::function<void(const float* x, const float* y, const float* z, float* values, size_t count)>;
inline constexpr size_t kFieldBatch = 4096;

// How near a vertex comes to a corner of the grid.
inline constexpr double kMinFraction = 1.0 / 64;
inline constexpr int kMaxCellsPerAxis = 1024;

struct MarchingCubesOptions {
  std::array<float, 3> box_min{-2.2f, -2.2f, -2.2f}, box_max{2.2f, 2.2f, 2.2f};
  float cell = 0.016f;
  // No value differs from another by more than this many times their distance.
  float max_slope = 1.5f;
  // Steps of the secant method (regula falsi, Illinois) that move each vertex along its edge of the grid.
  int refine_steps = 2;
  // Maximum number of grid points; larger surfaces are refused. Each point takes 16 bytes of memory.
  size_t max_points = 8 << 20;
};

struct MarchingCubesStats {
  size_t grid_points = 0;  // of the whole grid
  size_t evaluations = 0;  // of the field, refinement included
};

// Positions and triangles of the surface; empty where the field has none in the box. The same for any number of
// threads. Throws MAQ_ERROR_INVALID_ARGUMENT for a box or cell that is not finite, not positive or gives more than
// kMaxCellsPerAxis, and where the field is not a number; MAQ_ERROR_OUT_OF_MEMORY beyond `max_points`; the field's
// errors; std::bad_alloc.
HeadMesh marching_cubes(const ScalarField& field, const MarchingCubesOptions& options, WorkerThreads& threads,
                        MarchingCubesStats* stats = nullptr);

}  // namespace maq::head
