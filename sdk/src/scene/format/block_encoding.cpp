#include "scene/format/block_encoding.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <type_traits>

#include "scene/format/scene_layout.h"

namespace maq {
namespace {

template <class Stored>
inline Stored nearest(double steps, double least, double most) {
  const double within = std::min(std::max(steps, least), most);
  return Stored(int32_t(within + (within < 0 ? -0.5 : 0.5)));  // no call, as of nearbyint: it becomes vectors
}

template <class Stored>
Stored* from(void* array, size_t element) {
  return static_cast<Stored*>(array) + element;
}

template <class Stored>
void encode_places(const ModelledPoints& points, const uint32_t* indices, SceneBlock& block, Stored* places) {
  const float* axes[3] = {points.x.data(), points.y.data(), points.z.data()};
  for (int axis = 0; axis < 3; ++axis, places += block.count) {
    const float* at = axes[axis];
    float low = at[indices[0]], high = low;
    for (uint32_t k = 1; k < block.count; ++k) {
      low = std::min(low, at[indices[k]]);
      high = std::max(high, at[indices[k]]);
    }
    block.low[axis] = low;
    block.high[axis] = high;
    if constexpr (std::is_same_v<Stored, float>) {
      for (uint32_t k = 0; k < block.count; ++k) places[k] = at[indices[k]];
    } else {
      constexpr double kMost = std::numeric_limits<Stored>::max();
      const float step = float((double(high) - low) / kMost);
      const double steps_a_unit = step > 0 ? 1 / double(step) : 0;
      block.place_step[axis] = step;
      for (uint32_t k = 0; k < block.count; ++k) {
        places[k] = nearest<Stored>((double(at[indices[k]]) - low) * steps_a_unit, 0, kMost);
      }
      // A decoder rounds q * step, then the sum.
      const double reached = double(low) + kMost * step;
      const double rounding = std::numeric_limits<float>::epsilon() * (std::abs(double(low)) + kMost * step);
      block.high[axis] = float(std::max(double(high), reached) + rounding);
    }
  }
}

// `given` has `count` rows of kColumns numbers; `middle` is null where it is 0.
template <int kColumns, class Given, class Stored>
void encode_numbers(Given given, uint32_t count, float* middle, float* step, Stored* stored) {
  if constexpr (std::is_same_v<Stored, float>) {
    for (int c = 0; c < kColumns; ++c) step[c] = 1;
    for (uint32_t k = 0; k < count; ++k) std::copy_n(given(k), kColumns, stored + size_t(k) * kColumns);
  } else {
    constexpr double kMost = std::numeric_limits<Stored>::max();
    float low[kColumns] = {}, high[kColumns] = {};
    for (uint32_t k = 0; k < count; ++k) {
      const float* row = given(k);
      for (int c = 0; c < kColumns; ++c) {
        low[c] = k == 0 ? row[c] : std::min(low[c], row[c]);
        high[c] = k == 0 ? row[c] : std::max(high[c], row[c]);
      }
    }
    double middles[kColumns] = {}, steps_a_unit[kColumns];
    for (int c = 0; c < kColumns; ++c) {
      double reach = std::max(std::abs(double(low[c])), std::abs(double(high[c])));
      if (middle != nullptr) {
        middle[c] = float((double(low[c]) + high[c]) / 2);
        middles[c] = middle[c];
        reach = (double(high[c]) - low[c]) / 2;
      }
      step[c] = float(reach / kMost);
      steps_a_unit[c] = step[c] > 0 ? 1 / double(step[c]) : 0;
    }
    for (uint32_t k = 0; k < count; ++k, stored += kColumns) {
      const float* row = given(k);
      for (int c = 0; c < kColumns; ++c) {
        stored[c] = nearest<Stored>((double(row[c]) - middles[c]) * steps_a_unit[c], -kMost, kMost);
      }
    }
  }
}

template <class Stored>
void encode_looks(const ModelledPoints& points, const uint32_t* indices, SceneBlock& block, const SceneArrays& arrays) {
  const auto mean = [&](uint32_t k) { return &points.means[size_t(indices[k]) * kFeatures]; };
  const auto slope = [&](uint32_t k) { return &points.slopes[size_t(indices[k]) * kSlopes]; };
  encode_numbers<kFeatures>(mean, block.count, block.mean_middle, block.mean_step,
                            from<Stored>(arrays.means, size_t(block.first) * kFeatures));
  encode_numbers<int(kSlopes)>(slope, block.varying, nullptr, block.slope_step,
                               from<Stored>(arrays.slopes, size_t(block.first_varying) * kSlopes));
}

}  // namespace

void encode_block(const ModelledPoints& points, const uint32_t* indices, SceneBlock& block, const SceneArrays& arrays) {
  const size_t place = size_t(block.first) * 3;
  switch (arrays.place_kind) {
    case Places::kFloat32: encode_places(points, indices, block, from<float>(arrays.places, place)); break;
    case Places::kUint16: encode_places(points, indices, block, from<uint16_t>(arrays.places, place)); break;
  }
  switch (arrays.coefficient_kind) {
    case Coefficients::kFloat32: encode_looks<float>(points, indices, block, arrays); break;
    case Coefficients::kInt16: encode_looks<int16_t>(points, indices, block, arrays); break;
    case Coefficients::kInt8: encode_looks<int8_t>(points, indices, block, arrays); break;
  }
}

}  // namespace maq
