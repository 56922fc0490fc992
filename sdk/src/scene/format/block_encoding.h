// The points of one block as they are stored: as given, or as whole numbers of steps that the block chooses.
#pragma once

#include <cstdint>

#include "scene/format/fitted_points.h"
#include "scene/format/scene.h"

namespace maq {

// Where the arrays of a scene are being written.
struct SceneArrays {
  Places place_kind = Places::kFloat32;
  Coefficients coefficient_kind = Coefficients::kFloat32;
  void *places = nullptr, *means = nullptr, *slopes = nullptr;
};

// Fills the block's bounds and steps and its parts of the arrays with the points `indices`, whose first block.varying have
// slopes. `block` has its counts. Bounds hold what is stored, however a decoder rounds.
void encode_block(const ModelledPoints& points, const uint32_t* indices, SceneBlock& block, const SceneArrays& arrays);

}  // namespace maq
