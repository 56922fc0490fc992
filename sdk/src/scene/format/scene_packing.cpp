#include "scene/format/scene_packing.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "scene/format/block_encoding.h"
#include "scene/format/descriptor_outliers.h"
#include "scene/format/scene_blocks.h"
#include "scene/format/scene_layout.h"
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
  Bytes places, means, slopes;
};

bool is_sound(float value) { return std::abs(value) <= kLargestInScene; }  // false for NaN

void check(const ModelledPoints& points) {
  const size_t count = points.count();
  if (count == 0) throw Error(MAQ_ERROR_INVALID_ARGUMENT, "There is no point to make a scene of: no photo saw any.");
  if (count > kMostPoints) {
    throw Error(MAQ_ERROR_UNSUPPORTED, count, " points are too many: a scene has at most ", kMostPoints, ".");
  }
  if (points.y.size() != count || points.z.size() != count || points.means.size() != count * kFeatures ||
      points.slopes.size() != count * kSlopes || points.variations.size() != count) {
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
    if (!is_sound(points.x[i]) || !is_sound(points.y[i]) || !is_sound(points.z[i])) {
      throw Error(MAQ_ERROR_INVALID_ARGUMENT, "Point ", i, " is at (", points.x[i], ", ", points.y[i], ", ",
                  points.z[i], "): not finite, or too far away.");
    }
    const float* mean = &points.means[i * kFeatures];
    const float* slope = &points.slopes[i * kSlopes];
    if (!std::all_of(mean, mean + kFeatures, is_sound) || !std::all_of(slope, slope + kSlopes, is_sound) ||
        std::isnan(points.variations[i])) {
      throw Error(MAQ_ERROR_INVALID_ARGUMENT, "The look of point ", i,
                  " is not finite or too large; the networks may be damaged.");
    }
  }
}

// Of the variation, where both limits are kept.
float least_variation(const ModelledPoints& points, const ScenePacking& packing) {
  if (!(packing.most_varying >= 0 && packing.most_varying <= 1)) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "The share of points that may vary is ", packing.most_varying,
                ", but must be 0 to 1.");
  }
  const auto kept = size_t(double(packing.most_varying) * double(points.count()));
  if (kept == points.count()) return packing.least_variation;
  std::vector<float> variations = points.variations;
  const auto last_left_out = variations.end() - std::ptrdiff_t(kept) - 1;
  std::nth_element(variations.begin(), last_left_out, variations.end());
  return std::max(packing.least_variation, std::nextafter(*last_left_out, HUGE_VALF));
}

}  // namespace

PointOrder order_points(const ModelledPoints& points, const ScenePacking& packing) {
  check(points);
  const float least = least_variation(points, packing);
  const PointPlaces places = {points.x.data(), points.y.data(), points.z.data(), points.count(), points.origin};
  // Without steps one group will do.
  const bool has_steps = packing.coefficients != Coefficients::kFloat32;
  BlockOrder cut;
  for (const auto& group : set_wild_apart(points, least, has_steps)) {
    cut_into_blocks(places, group, SceneBlock::kMostPoints, cut);
  }
  PointOrder order;
  order.blocks.reserve(cut.ends.size());
  auto begin = cut.order.begin();
  for (const uint32_t last : cut.ends) {
    const auto end = cut.order.begin() + last;
    const auto constant = std::stable_partition(begin, end, [&](uint32_t i) { return look_varies(points, i, least); });
    order.blocks.push_back({uint32_t(end - begin), uint32_t(constant - begin)});
    begin = end;
  }
  order.points = std::move(cut.order);
  return order;
}

Scene make_scene(const ModelledPoints& points, const ScenePacking& packing) {
  const PointOrder order = order_points(points, packing);
  const auto owned = std::make_shared<OwnedArrays>();
  Scene scene;
  scene.origin = points.origin;
  scene.up = points.up;
  scene.background = points.background;
  scene.place_kind = packing.places;
  scene.coefficient_kind = packing.coefficients;
  owned->blocks.resize(order.blocks.size());
  for (size_t b = 0; b < order.blocks.size(); ++b) {
    SceneBlock& block = owned->blocks[b];
    block.first = scene.points;
    block.count = order.blocks[b].count;
    block.varying = order.blocks[b].varying;
    block.first_varying = scene.varying;
    scene.points += block.count;
    scene.varying += block.varying;
  }
  scene.block_count = uint32_t(owned->blocks.size());
  scene.blocks = owned->blocks.data();
  owned->places = zeros(places_bytes(scene));
  owned->means = zeros(means_bytes(scene));
  owned->slopes = zeros(slopes_bytes(scene));
  scene.places = owned->places.data();
  scene.means = owned->means.data();
  scene.slopes = owned->slopes.data();
  const SceneArrays arrays = {packing.places, packing.coefficients, owned->places.data(), owned->means.data(),
                              owned->slopes.data()};
  for (SceneBlock& block : owned->blocks) encode_block(points, &order.points[block.first], block, arrays);
  scene.owner = owned;
  return scene;
}

}  // namespace maq
