#include "scene/format/scene_packing.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "scene/format/block_codec.h"
#include "scene/format/descriptor_outliers.h"
#include "scene/format/scene.h"
#include "scene/format/scene_blocks.h"
#include "scene/point_cloud.h"

namespace maq {
namespace {

// Arrays begin at cache lines, as sections of a file do.
struct alignas(64) CacheLine {
  uint8_t bytes[64];
};
using Bytes = std::vector<CacheLine>;

Bytes zeros(size_t bytes) { return Bytes((bytes + sizeof(CacheLine) - 1) / sizeof(CacheLine)); }

struct OwnedArrays {
  std::vector<SceneBlock> blocks;
  Bytes positions, constant_terms, linear_terms;
};

bool is_in_range(float value) { return std::abs(value) <= kMaxMagnitude; }  // false for NaN

void check(const FittedPoints& points) {
  const size_t count = points.count();
  if (count == 0) throw Error(MAQ_ERROR_INVALID_ARGUMENT, "There is no point to make a scene of: no photo saw any.");
  if (count > kMaxPoints) {
    throw Error(MAQ_ERROR_UNSUPPORTED, count, " points are too many: a scene has at most ", kMaxPoints, ".");
  }
  if (points.y.size() != count || points.z.size() != count || points.constant_terms.size() != count * kFeatures ||
      points.linear_terms.size() != count * kLinearTerms || points.view_dependence.size() != count) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "There are ", count, " points, but their lists are not of that length.");
  }
  for (const auto& vector : {points.origin, points.up}) {
    if (!std::isfinite(vector[0]) || !std::isfinite(vector[1]) || !std::isfinite(vector[2])) {
      throw Error(MAQ_ERROR_INVALID_ARGUMENT, "The scene's origin and direction of up must be finite numbers.");
    }
  }
  for (const float part : points.background) {
    if (!(part >= 0 && part <= 1)) {
      throw Error(MAQ_ERROR_INVALID_ARGUMENT, "The background's colour has a part ", part, ", which is not 0 to 1.");
    }
  }
  for (size_t i = 0; i < count; ++i) {
    if (!is_in_range(points.x[i]) || !is_in_range(points.y[i]) || !is_in_range(points.z[i])) {
      throw Error(MAQ_ERROR_INVALID_ARGUMENT, "Point ", i, " is at (", points.x[i], ", ", points.y[i], ", ",
                  points.z[i], "): not finite, or too far away.");
    }
    const float* constant = &points.constant_terms[i * kFeatures];
    const float* linear = &points.linear_terms[i * kLinearTerms];
    if (!std::all_of(constant, constant + kFeatures, is_in_range) ||
        !std::all_of(linear, linear + kLinearTerms, is_in_range) || std::isnan(points.view_dependence[i])) {
      throw Error(MAQ_ERROR_INVALID_ARGUMENT, "The descriptor of point ", i,
                  " is not finite or too large; the networks may be damaged.");
    }
  }
}

// The threshold of view-dependence that keeps both limits.
float threshold_of(const FittedPoints& points, const ScenePacking& packing) {
  if (!(packing.max_view_dependent_fraction >= 0 && packing.max_view_dependent_fraction <= 1)) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "The fraction of view-dependent points is ",
                packing.max_view_dependent_fraction, ", but must be 0 to 1.");
  }
  const auto kept = size_t(double(packing.max_view_dependent_fraction) * double(points.count()));
  if (kept == points.count()) return packing.min_view_dependence;
  std::vector<float> view_dependence = points.view_dependence;
  const auto last_left_out = view_dependence.end() - std::ptrdiff_t(kept) - 1;
  std::nth_element(view_dependence.begin(), last_left_out, view_dependence.end());
  return std::max(packing.min_view_dependence, std::nextafter(*last_left_out, HUGE_VALF));
}

}  // namespace

ScenePacking packing_of(CoefficientFormat coefficients, std::optional<float> min_view_dependence) {
  ScenePacking packing;
  packing.coefficients = coefficients;
  if (coefficients == CoefficientFormat::kFloat32) packing.positions = PositionFormat::kFloat32;
  if (min_view_dependence) {
    packing.min_view_dependence = *min_view_dependence;
  } else if (coefficients == CoefficientFormat::kInt8) {
    // At most 40 bytes a point, also where every point is view-dependent.
    packing.max_view_dependent_fraction = 0.5f;
  }
  return packing;
}

PointOrder order_points(const FittedPoints& points, const ScenePacking& packing) {
  check(points);
  const float threshold = threshold_of(points, packing);
  const PointPositions positions = {points.x.data(), points.y.data(), points.z.data(), points.count(), points.origin};
  // Without steps one group will do.
  const bool has_steps = packing.coefficients != CoefficientFormat::kFloat32;
  BlockOrder split;
  for (const auto& group : separate_outliers(points, threshold, has_steps)) {
    split_into_blocks(positions, group, SceneBlock::kMaxPoints, split);
  }
  PointOrder order;
  order.blocks.reserve(split.ends.size());
  auto begin = split.order.begin();
  for (const uint32_t last : split.ends) {
    const auto end = split.order.begin() + last;
    const auto constant =
        std::stable_partition(begin, end, [&](uint32_t i) { return is_view_dependent(points, i, threshold); });
    order.blocks.push_back({uint32_t(end - begin), uint32_t(constant - begin)});
    begin = end;
  }
  order.points = std::move(split.order);
  return order;
}

Scene make_scene(const FittedPoints& points, const ScenePacking& packing) {
  const PointOrder order = order_points(points, packing);
  const auto owned = std::make_shared<OwnedArrays>();
  Scene scene;
  scene.origin = points.origin;
  scene.up = points.up;
  scene.background = points.background;
  scene.position_format = packing.positions;
  scene.coefficient_format = packing.coefficients;
  owned->blocks.resize(order.blocks.size());
  for (size_t b = 0; b < order.blocks.size(); ++b) {
    SceneBlock& block = owned->blocks[b];
    block.first = scene.points;
    block.count = order.blocks[b].count;
    block.view_dependent = order.blocks[b].view_dependent;
    block.first_view_dependent = scene.view_dependent;
    scene.points += block.count;
    scene.view_dependent += block.view_dependent;
  }
  scene.block_count = uint32_t(owned->blocks.size());
  scene.blocks = owned->blocks.data();
  owned->positions = zeros(positions_bytes(scene));
  owned->constant_terms = zeros(constant_terms_bytes(scene));
  owned->linear_terms = zeros(linear_terms_bytes(scene));
  scene.positions = owned->positions.data();
  scene.constant_terms = owned->constant_terms.data();
  scene.linear_terms = owned->linear_terms.data();
  const SceneArrays arrays = {packing.positions, packing.coefficients, owned->positions.data(),
                              owned->constant_terms.data(), owned->linear_terms.data()};
  for (SceneBlock& block : owned->blocks) encode_block(points, &order.points[block.first], block, arrays);
  scene.owner = owned;
  return scene;
}

}  // namespace maq
