#pragma once

#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "api/handle.h"
#include "head/reconstruction/head_surface.h"
#include "head/head_template.h"
#include "head/mesh/head_mesh.h"
#include "head/stored_head.h"
#include "maquette/head.h"

constexpr char kHeadsBundle[] = "heads-int8";  // of a config, or of options, that name none

// A head stays what it is while the app has it; its mesh is made when it is asked for.
struct maq_head : maq::HandleOf<maq::HandleKind::kHead> {
  maq_head(maq::head::StoredHead of, int thread_count,
           std::shared_ptr<const maq::head::HeadTemplate> of_bundle = nullptr)
      : head(std::move(of)), threads(thread_count), template_head(std::move(of_bundle)) {}
  const maq::head::StoredHead head;
  const int threads;
  std::shared_ptr<const maq::head::HeadTemplate> template_head;  // null: it was not asked for yet
  maq::head::HeadMesh mesh;
  std::vector<float> positions_m, template_points_m;  // of the mesh
  std::vector<std::vector<float>> morph_moves_m;      // of its morph targets
  maq_head_topology mesh_topology = MAQ_HEAD_TOPOLOGY_FIELD;
  maq::head::SurfaceOptions mesh_options{0, 0};  // of 0 triangles: none was made
  maq::head::SurfaceStats mesh_stats;
};

// Makes the mesh, unless it is there; for calls that run one at a time on a head. `options` as in maq_head_get_mesh.
const maq::head::HeadMesh& mesh_of(maq_head& head, const maq_head_mesh_options* options);

// The JPEG file of the mesh that the head has; empty where there is none, as for the template's topology, whose texture
// coordinates are of another layout.
const std::vector<uint8_t>& texture_of(const maq_head& head);
