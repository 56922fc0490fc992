#include "scene/scene_packing.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <type_traits>

#include "core/error.h"
#include "scene/scene_blocks.h"

namespace maq {
namespace {

constexpr int kSlopes = kBasis * kFeatures;

// Arrays begin at cache lines, as sections of a file do.
struct alignas(64) CacheLine {
  uint8_t bytes[64];
};

struct OwnedArrays {
  std::vector<SceneBlock> blocks;
  std::vector<CacheLine> places, means, slopes;
};

std::vector<CacheLine> lines_for(size_t bytes) { return std::vector<CacheLine>((bytes + 63) / 64); }

// What one number takes.
size_t size_bytes(Places kind) { return kind == Places::kFloat32 ? 4 : 2; }
size_t size_bytes(Coefficients kind) {
  return kind == Coefficients::kFloat32 ? 4 : kind == Coefficients::kInt16 ? 2 : 1;
}

bool is_sound(float value) { return std::abs(value) <= kLargestInScene; }  // no for NaN

void check(const ModelledPoints& points) {
  const size_t count = points.count();
  if (count == 0) throw Error(MAQ_ERROR_INVALID_ARGUMENT, "There is no point to make a scene of: no photo saw any.");
  if (count > std::numeric_limits<uint32_t>::max() / kSlopes) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, count, " points are too many for a scene.");
  }
  if (points.y.size() != count || points.z.size() != count || points.means.size() != count * kFeatures ||
      points.slopes.size() != count * kSlopes || points.variations.size() != count) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "There are ", count, " points, but their lists are not of that length.");
  }
  for (const double value :
       {points.origin[0], points.origin[1], points.origin[2], points.up[0], points.up[1], points.up[2]}) {
    if (!std::isfinite(value)) {
      throw Error(MAQ_ERROR_INVALID_ARGUMENT, "The scene's origin and direction of up must be finite numbers.");
    }
  }
  for (size_t i = 0; i < count; ++i) {
    const float* mean = &points.means[i * kFeatures];
    const float* slope = &points.slopes[i * kSlopes];
    if (!is_sound(points.x[i]) || !is_sound(points.y[i]) || !is_sound(points.z[i])) {
      throw Error(MAQ_ERROR_INVALID_ARGUMENT, "Point ", i, " is at (", points.x[i], ", ", points.y[i], ", ",
                  points.z[i], "): not finite, or too far away.");
    }
    if (!std::all_of(mean, mean + kFeatures, is_sound) || !std::all_of(slope, slope + kSlopes, is_sound) ||
        std::isnan(points.variations[i])) {
      throw Error(MAQ_ERROR_INVALID_ARGUMENT, "The look of point ", i,
                  " is not finite or too large: the networks may be damaged.");
    }
  }
}

bool varies(const ModelledPoints& points, uint32_t i, float least_variation) {
  if (points.variations[i] < least_variation) return false;
  const float* slope = &points.slopes[size_t(i) * kSlopes];
  return std::any_of(slope, slope + kSlopes, [](float value) { return value != 0; });
}

template <class Stored>
Stored nearest(double value, double least, double most) {
  return Stored(std::clamp(std::nearbyint(value), least, most));
}

// One block of one kind of numbers. `indices` are its points, those with slopes first.
class BlockWriter {
 public:
  BlockWriter(const ModelledPoints& points, const uint32_t* indices, SceneBlock& block)
      : points_(points), indices_(indices), block_(block) {}

  template <class Stored>
  void write_places(Stored* places) {
    const std::vector<float>* axes[3] = {&points_.x, &points_.y, &points_.z};
    for (int axis = 0; axis < 3; ++axis, places += block_.count) {
      const std::vector<float>& at = *axes[axis];
      float low = at[indices_[0]], high = low;
      for (uint32_t k = 1; k < block_.count; ++k) {
        low = std::min(low, at[indices_[k]]);
        high = std::max(high, at[indices_[k]]);
      }
      block_.low[axis] = low;
      block_.high[axis] = high;
      if constexpr (std::is_same_v<Stored, float>) {
        for (uint32_t k = 0; k < block_.count; ++k) places[k] = at[indices_[k]];
      } else {
        constexpr double kMost = std::numeric_limits<Stored>::max();
        const float step = float((double(high) - low) / kMost);
        block_.place_step[axis] = step;
        for (uint32_t k = 0; k < block_.count; ++k) {
          places[k] = step > 0 ? nearest<Stored>((double(at[indices_[k]]) - low) / step, 0, kMost) : Stored(0);
        }
        // What is stored lies in the box too, however low + q * step is rounded.
        const float reached = float(low + kMost * step);
        block_.high[axis] = std::nextafter(std::max(high, reached), std::numeric_limits<float>::infinity());
      }
    }
  }

  template <class Stored>
  void write_means(Stored* means) {
    for (int c = 0; c < kFeatures; ++c) {
      const auto given = [&](uint32_t k) { return points_.means[size_t(indices_[k]) * kFeatures + c]; };
      if constexpr (std::is_same_v<Stored, float>) {
        block_.mean_step[c] = 1;
        for (uint32_t k = 0; k < block_.count; ++k) means[k * kFeatures + c] = given(k);
      } else {
        float low = given(0), high = low;
        for (uint32_t k = 1; k < block_.count; ++k) {
          low = std::min(low, given(k));
          high = std::max(high, given(k));
        }
        constexpr double kMost = std::numeric_limits<Stored>::max();
        const float middle = float((double(low) + high) / 2), step = float((double(high) - low) / (2 * kMost));
        block_.mean_middle[c] = middle;
        block_.mean_step[c] = step;
        for (uint32_t k = 0; k < block_.count; ++k) {
          means[k * kFeatures + c] =
              step > 0 ? nearest<Stored>((double(given(k)) - middle) / step, -kMost, kMost) : Stored(0);
        }
      }
    }
  }

  template <class Stored>
  void write_slopes(Stored* slopes) {
    for (int c = 0; c < kSlopes; ++c) {
      const auto given = [&](uint32_t k) { return points_.slopes[size_t(indices_[k]) * kSlopes + c]; };
      if constexpr (std::is_same_v<Stored, float>) {
        block_.slope_step[c] = 1;
        for (uint32_t k = 0; k < block_.varying; ++k) slopes[k * kSlopes + c] = given(k);
      } else {
        float largest = 0;
        for (uint32_t k = 0; k < block_.varying; ++k) largest = std::max(largest, std::abs(given(k)));
        constexpr double kMost = std::numeric_limits<Stored>::max();
        const float step = float(largest / kMost);
        block_.slope_step[c] = step;
        for (uint32_t k = 0; k < block_.varying; ++k) {
          slopes[k * kSlopes + c] = step > 0 ? nearest<Stored>(double(given(k)) / step, -kMost, kMost) : Stored(0);
        }
      }
    }
  }

 private:
  const ModelledPoints& points_;
  const uint32_t* indices_;
  SceneBlock& block_;
};

template <class Stored>
Stored* from(std::vector<CacheLine>& lines, size_t element) {
  return reinterpret_cast<Stored*>(lines.data()) + element;
}

void write_block(const ModelledPoints& points, const uint32_t* indices, const ScenePacking& packing, SceneBlock& block,
                 OwnedArrays& arrays) {
  BlockWriter writer(points, indices, block);
  const size_t place = size_t(block.first) * 3;
  const size_t mean = size_t(block.first) * kFeatures, slope = size_t(block.first_varying) * kSlopes;
  switch (packing.places) {
    case Places::kFloat32: writer.write_places(from<float>(arrays.places, place)); break;
    case Places::kUint16: writer.write_places(from<uint16_t>(arrays.places, place)); break;
  }
  const auto write_looks = [&](auto zero) {
    using Stored = decltype(zero);
    writer.write_means(from<Stored>(arrays.means, mean));
    if (block.varying > 0) writer.write_slopes(from<Stored>(arrays.slopes, slope));
  };
  switch (packing.coefficients) {
    case Coefficients::kFloat32: write_looks(float()); break;
    case Coefficients::kInt16: write_looks(int16_t()); break;
    case Coefficients::kInt8: write_looks(int8_t()); break;
  }
}

}  // namespace

Scene make_scene(const ModelledPoints& points, const ScenePacking& packing) {
  check(points);
  const PointPlaces places = {points.x.data(), points.y.data(), points.z.data(), points.count(), points.origin};
  std::vector<uint32_t> all(points.count());
  std::iota(all.begin(), all.end(), 0);
  BlockOrder cut = cut_into_blocks(places, all, SceneBlock::kMostPoints);

  const auto arrays = std::make_shared<OwnedArrays>();
  arrays->blocks.resize(cut.ends.size());
  uint32_t first = 0, varying = 0;
  for (size_t b = 0; b < cut.ends.size(); ++b) {
    const auto begin = cut.order.begin() + first, end = cut.order.begin() + cut.ends[b];
    const auto constant =
        std::stable_partition(begin, end, [&](uint32_t i) { return varies(points, i, packing.least_variation); });
    SceneBlock& block = arrays->blocks[b];
    block.first = first;
    block.count = cut.ends[b] - first;
    block.varying = uint32_t(constant - begin);
    block.first_varying = varying;
    first += block.count;
    varying += block.varying;
  }
  arrays->places = lines_for(size_t(first) * 3 * size_bytes(packing.places));
  arrays->means = lines_for(size_t(first) * kFeatures * size_bytes(packing.coefficients));
  arrays->slopes = lines_for(size_t(varying) * kSlopes * size_bytes(packing.coefficients));
  for (SceneBlock& block : arrays->blocks) write_block(points, &cut.order[block.first], packing, block, *arrays);

  Scene scene;
  scene.origin = points.origin;
  scene.up = points.up;
  scene.place_kind = packing.places;
  scene.coefficient_kind = packing.coefficients;
  scene.points = first;
  scene.varying = varying;
  scene.block_count = uint32_t(arrays->blocks.size());
  scene.blocks = arrays->blocks.data();
  scene.places = arrays->places.data();
  scene.means = arrays->means.data();
  scene.slopes = arrays->slopes.data();
  scene.owner = arrays;
  return scene;
}

}  // namespace maq
