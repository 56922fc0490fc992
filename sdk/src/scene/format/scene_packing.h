// From fitted points to a scene that can be rendered and stored.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "scene/format/fitted_points.h"
#include "scene/format/scene.h"

namespace maq {

struct ScenePacking {
  PositionFormat positions = PositionFormat::kUint16;
  CoefficientFormat coefficients = CoefficientFormat::kInt8;
  // Points whose view-dependence (FittedPoints, in the features' own units) is below that keep their constant term
  // alone. 0 keeps the linear terms of all but those that have none.
  float min_view_dependence = 0.05f;
  // At most that fraction of the points keep their linear terms: the most view-dependent ones. With 0.5 a scene of int8
  // and uint16 takes 39 bytes a point at most.
  float max_view_dependent_fraction = 1;
};

// Positions are 16 bits, but floats beside coefficients in floats. Without a threshold it is the default, and with 8
// bits at most half of the points are view-dependent.
ScenePacking packing_of(CoefficientFormat coefficients, std::optional<float> min_view_dependence);

// Larger numbers stand for something broken, and sums of them would not be finite.
inline constexpr float kMaxMagnitude = 1e30f;

// The points of a scene in the order in which it stores them: block after block.
struct PointOrder {
  struct Block {
    uint32_t count, view_dependent;  // the view-dependent points come first
  };
  std::vector<uint32_t> points;  // indices among those given
  std::vector<Block> blocks;
};

// The first half of make_scene(), which throws the same.
PointOrder order_points(const FittedPoints& points, const ScenePacking& packing);

// The scene owns its arrays. With kFloat32, positions and coefficients are exactly the given ones. Throws
// MAQ_ERROR_INVALID_ARGUMENT without points, where lists differ in length, for a fraction outside 0..1, and for
// positions and coefficients that are not finite or over kMaxMagnitude; MAQ_ERROR_UNSUPPORTED for more than kMaxPoints.
Scene make_scene(const FittedPoints& points, const ScenePacking& packing);

}  // namespace maq
