// The surface of a fitted head as a mesh, with normals, colours and template points; and where its landmarks lie.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "core/worker_threads.h"
#include "head/mesh/head_mesh.h"
#include "head/stored_head.h"

namespace maq::head {

inline constexpr double kMinSurfaceCell_m = 0.0005, kMaxSurfaceCell_m = 0.02;
inline constexpr size_t kAllTriangles = SIZE_MAX;

struct SurfaceOptions {
  double cell_m = 0;                 // the edge of a cube, in metres; 0: default_surface_cell_m(triangles)
  size_t triangles = kAllTriangles;  // about as many are left (simplify_mesh)
};

// Cell of a full mesh for this many remaining triangles. A cell of 2.1 mm gives some 115,000 triangles, 1.6 mm some
// 200,000.
constexpr double default_surface_cell_m(size_t triangles) { return triangles > 60000 ? 0.0016 : 0.0021; }

struct SurfaceStats {
  size_t full_triangles = 0;  // before simplification
  double error_m = 0;         // the largest distance of a vertex of the full mesh from the simplified one
};

// Marching cubes of max(the field's distance, that to the cut plane), so that the head is closed below the chin; of
// this the largest piece, simplified. Normals are the gradient of the larger value of the two. Lengths are true
// decimetres: lengths in the head's frame times its scale. The same for any number of threads. Throws
// MAQ_ERROR_INVALID_ARGUMENT for a cell beyond the limits, or too small for kMaxCellsPerAxis; MAQ_ERROR_UNSUPPORTED if
// the field has no surface in its domain; and the errors of marching_cubes().
HeadMesh head_surface(const StoredHead& head, const SurfaceOptions& surface, WorkerThreads& threads,
                      SurfaceStats* stats = nullptr);

// The byte of a colour of the field; 0 if it is not a number.
uint8_t byte_of_logit(float logit);

struct HeadLandmark {
  Vec3 point;        // in the head's frame and unit
  double sigma = 0;  // standard deviation of each coordinate, as the anchors around it have
};

// By the anchors around a point of the template head (dm); the point itself where there are none.
HeadLandmark landmark_by_anchors(const StoredAnchors& anchors, Vec3 template_point);

// Throws MAQ_ERROR_NOT_FOUND for a name that the head does not have.
HeadLandmark find_head_landmark(const StoredHead& head, const std::string& name);

}  // namespace maq::head
