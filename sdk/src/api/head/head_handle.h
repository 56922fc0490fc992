#pragma once

#include <utility>
#include <vector>

#include "api/handle.h"
#include "head/build/head_surface.h"
#include "head/mesh/head_mesh.h"
#include "head/stored_head.h"
#include "maquette/head.h"

// A head stays what it is while the app has it; its mesh is made when it is asked for.
struct maq_head : maq::HandleOf<maq::HandleKind::kHead> {
  maq_head(maq::head::StoredHead of, int thread_count) : head(std::move(of)), threads(thread_count) {}
  const maq::head::StoredHead head;
  const int threads;
  maq::head::HeadMesh mesh;
  std::vector<float> positions_m, template_points_m;  // of the mesh
  maq::head::SurfaceOptions mesh_options{0, 0};       // of a cell of 0: none was made
  maq::head::SurfaceStats mesh_stats;
};

// Makes the mesh, unless it is there; for calls that run one at a time on a head. `options` as in maq_head_get_mesh.
const maq::head::HeadMesh& mesh_of(maq_head& head, const maq_head_mesh_options* options);
