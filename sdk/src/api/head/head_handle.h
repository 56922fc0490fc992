#pragma once

#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "api/handle.h"
#include "head/head_template.h"
#include "head/mesh/head_mesh.h"
#include "head/stored_head.h"
#include "maquette/head.h"

constexpr char kHeadsBundle[] = "heads-int8";  // of configs that name no bundle

// Nothing of a head changes while the app has it.
struct maq_head : maq::HandleOf<maq::HandleKind::kHead> {
  maq_head(maq::head::StoredHead of, int thread_count,
           std::shared_ptr<const maq::head::HeadTemplate> of_bundle = nullptr)
      : head(std::move(of)), threads(thread_count), template_head(std::move(of_bundle)) {}
  const maq::head::StoredHead head;
  const int threads;
  const std::shared_ptr<const maq::head::HeadTemplate> template_head;  // null for heads from files
};

struct maq_head_mesh : maq::HandleOf<maq::HandleKind::kHeadMesh> {
  maq::head::HeadMesh mesh;           // in decimetres
  std::vector<uint8_t> texture_jpeg;  // may be empty
  // Arrays of the mesh and its morph targets in the app's frame (file_axes.h).
  std::vector<float> positions_m, normals, template_points_m;
  std::vector<std::vector<float>> morph_deltas_m;
  float simplification_error_m = 0;
};
