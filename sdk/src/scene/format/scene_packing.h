// From modelled points to a scene that can be rendered and stored.
#pragma once

#include <cstdint>
#include <vector>

#include "scene/format/fitted_points.h"
#include "scene/format/scene.h"

namespace maq {

struct ScenePacking {
  Places places = Places::kUint16;
  Coefficients coefficients = Coefficients::kInt8;
  // Points whose look moves by less than that from its mean over the photos (ModelledPoints::variations, in the features'
  // own units) keep the mean alone. 0 keeps the slopes of all but those that have none.
  float least_variation = 0.05f;
  // At most that share of the points keep their slopes: those whose looks move most. With 0.5 a scene of int8 and uint16
  // takes 39 bytes a point at most.
  float most_varying = 1;
};

// Beyond that numbers stand for something broken, and sums of them would not be finite.
inline constexpr float kLargestInScene = 1e30f;

// The points of a scene in the order in which it stores them: block after block.
struct PointOrder {
  struct Block {
    uint32_t count, varying;  // points, and how many of them, the first, keep their slopes
  };
  std::vector<uint32_t> points;  // indices among those given
  std::vector<Block> blocks;
};

// The first half of make_scene(), which throws the same.
PointOrder order_points(const ModelledPoints& points, const ScenePacking& packing);

// The scene owns its arrays. With kFloat32 places and looks are exactly those given.
// Throws MAQ_ERROR_INVALID_ARGUMENT without points, where lists differ in length, a share outside 0..1, and
// for places and looks that are not finite or over kLargestInScene; MAQ_ERROR_UNSUPPORTED for more than kMostPoints.
Scene make_scene(const ModelledPoints& points, const ScenePacking& packing);

}  // namespace maq
