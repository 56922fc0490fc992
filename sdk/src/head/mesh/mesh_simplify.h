// Fewer triangles for a mesh, and how far that moves its surface.
#pragma once

#include <cstddef>
#include <vector>

#include "core/worker_threads.h"
#include "head/mesh/head_mesh.h"

namespace maq::head {

// Collapses edges, the one that costs the least first, until no more than `triangles` are left (Garland and Heckbert,
// Surface simplification using quadric error metrics, SIGGRAPH 1997). A closed manifold stays one, of the same genus:
// an edge whose collapse would join sheets, or turn a triangle over, stays. So a few more triangles can be left than
// were asked for. Only positions and triangles are kept, as vertices move; take all else from the field afterwards.
// Deterministic. The mesh must be a closed manifold; one with fewer triangles stays as it is.
void simplify_mesh(HeadMesh& mesh, size_t triangles);

// The largest distance of `points`, x, y, z each, from the surface of `mesh`, which has triangles.
double largest_distance(const std::vector<float>& points, const HeadMesh& mesh, WorkerThreads& threads);

}  // namespace maq::head
