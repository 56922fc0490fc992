// Converts the points of one block to stored numbers and back: floats, or integers times a step that the block chooses.
#pragma once

#include <cstdint>

#include "scene/format/fitted_points.h"
#include "scene/format/scene.h"

namespace maq {

// Where the arrays of a scene are being written.
struct SceneArrays {
  PositionFormat position_format = PositionFormat::kFloat32;
  CoefficientFormat coefficient_format = CoefficientFormat::kFloat32;
  void *positions = nullptr, *constant_terms = nullptr, *linear_terms = nullptr;
};

// Fills the block's bounds and steps and its parts of the arrays with the points `indices`, of which the first
// block.view_dependent have linear terms. `block` has its counts. Bounds contain the stored positions, however a
// decoder rounds.
void encode_block(const FittedPoints& points, const uint32_t* indices, SceneBlock& block, const SceneArrays& arrays);

// The points of one block as floats, in its order; linear terms are 0 where there are none. Arrays that a scene does
// not keep stay empty: view_dependence and views. The renderer has its own decoder (descriptor_decoding.h).
FittedPoints decode_block(const Scene& scene, const SceneBlock& block);

}  // namespace maq
