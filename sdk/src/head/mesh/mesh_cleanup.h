// Prepares a mesh for display: one piece, with normals, and a known cap.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "core/worker_threads.h"
#include "head/mesh/head_mesh.h"

namespace maq::head {

// Keeps the piece with the largest area (of equal ones the one with the first triangle), in its order.
void keep_largest_piece(HeadMesh& mesh);

// Writes the field's gradient at each of `count` points to `gx`, `gy` and `gz`. Called as ScalarField is.
using GradientField =
    std::function<void(const float* x, const float* y, const float* z, float* gx, float* gy, float* gz, size_t count)>;

// Sets the normals to the gradient's direction; where the gradient is 0 or not finite, to the normal of the triangles
// around the vertex.
void set_normals(HeadMesh& mesh, const GradientField& gradient, WorkerThreads& threads);

// Sets the normals to the mean of the triangles around each vertex, by area; (0, 0, 1) where they have none.
void set_normals(HeadMesh& mesh);

// By vertex, 1 where it lies within `tolerance` of the plane of the points whose product with `normal`, of length 1, is
// `offset`: the cap of a head that ends there. A triangle of three such vertices belongs to the cap.
std::vector<uint8_t> find_cap(const HeadMesh& mesh, const std::array<float, 3>& normal, float offset, float tolerance);

}  // namespace maq::head
