#include "scene/format/block_codec.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <type_traits>

namespace maq {
namespace {

template <class Stored>
inline Stored nearest(double steps, double low, double high) {
  const double within = std::min(std::max(steps, low), high);
  return Stored(int32_t(within + (within < 0 ? -0.5 : 0.5)));  // unlike nearbyint() no call, so that it is vectorised
}

template <class Stored>
Stored* from(void* array, size_t element) {
  return static_cast<Stored*>(array) + element;
}

template <class Stored>
void encode_positions(const FittedPoints& points, const uint32_t* indices, SceneBlock& block, Stored* positions) {
  const float* axes[3] = {points.x.data(), points.y.data(), points.z.data()};
  for (int axis = 0; axis < 3; ++axis, positions += block.count) {
    const float* at = axes[axis];
    float low = at[indices[0]], high = low;
    for (uint32_t k = 1; k < block.count; ++k) {
      low = std::min(low, at[indices[k]]);
      high = std::max(high, at[indices[k]]);
    }
    block.low[axis] = low;
    block.high[axis] = high;
    if constexpr (std::is_same_v<Stored, float>) {
      for (uint32_t k = 0; k < block.count; ++k) positions[k] = at[indices[k]];
    } else {
      constexpr double kMax = std::numeric_limits<Stored>::max();
      const float step = float((double(high) - low) / kMax);
      const double steps_a_unit = step > 0 ? 1 / double(step) : 0;
      block.position_step[axis] = step;
      for (uint32_t k = 0; k < block.count; ++k) {
        positions[k] = nearest<Stored>((double(at[indices[k]]) - low) * steps_a_unit, 0, kMax);
      }
      // A decoder rounds q * step, then the sum.
      const double reached = double(low) + kMax * step;
      const double rounding = std::numeric_limits<float>::epsilon() * (std::abs(double(low)) + kMax * step);
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
    constexpr double kMax = std::numeric_limits<Stored>::max();
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
      double range = std::max(std::abs(double(low[c])), std::abs(double(high[c])));
      if (middle != nullptr) {
        middle[c] = float((double(low[c]) + high[c]) / 2);
        middles[c] = middle[c];
        range = (double(high[c]) - low[c]) / 2;
      }
      step[c] = float(range / kMax);
      steps_a_unit[c] = step[c] > 0 ? 1 / double(step[c]) : 0;
    }
    for (uint32_t k = 0; k < count; ++k, stored += kColumns) {
      const float* row = given(k);
      for (int c = 0; c < kColumns; ++c) {
        stored[c] = nearest<Stored>((double(row[c]) - middles[c]) * steps_a_unit[c], -kMax, kMax);
      }
    }
  }
}

template <class Stored>
void encode_descriptors(const FittedPoints& points, const uint32_t* indices, SceneBlock& block,
                        const SceneArrays& arrays) {
  const auto constant = [&](uint32_t k) { return &points.constant_terms[size_t(indices[k]) * kFeatures]; };
  const auto linear = [&](uint32_t k) { return &points.linear_terms[size_t(indices[k]) * kLinearTerms]; };
  encode_numbers<kFeatures>(constant, block.count, block.constant_middle, block.constant_step,
                            from<Stored>(arrays.constant_terms, size_t(block.first) * kFeatures));
  encode_numbers<int(kLinearTerms)>(
      linear, block.view_dependent, nullptr, block.linear_step,
      from<Stored>(arrays.linear_terms, size_t(block.first_view_dependent) * kLinearTerms));
}

// `numbers` of `columns` a row, each with its own middle and step; `middle` may be null.
template <class Stored>
void decode(const void* array, size_t first, size_t rows, size_t columns, const float* middle, const float* step,
            float* numbers) {
  const Stored* stored = static_cast<const Stored*>(array) + first;
  for (size_t i = 0; i < rows * columns; ++i) {
    const size_t c = i % columns;
    numbers[i] = std::is_same_v<Stored, float> ? float(stored[i])
                                               : (middle == nullptr ? 0 : middle[c]) + float(stored[i]) * step[c];
  }
}

}  // namespace

void encode_block(const FittedPoints& points, const uint32_t* indices, SceneBlock& block, const SceneArrays& arrays) {
  const size_t first = size_t(block.first) * 3;
  switch (arrays.position_format) {
    case PositionFormat::kFloat32:
      encode_positions(points, indices, block, from<float>(arrays.positions, first));
      break;
    case PositionFormat::kUint16:
      encode_positions(points, indices, block, from<uint16_t>(arrays.positions, first));
      break;
  }
  switch (arrays.coefficient_format) {
    case CoefficientFormat::kFloat32: encode_descriptors<float>(points, indices, block, arrays); break;
    case CoefficientFormat::kInt16: encode_descriptors<int16_t>(points, indices, block, arrays); break;
    case CoefficientFormat::kInt8: encode_descriptors<int8_t>(points, indices, block, arrays); break;
  }
}

FittedPoints decode_block(const Scene& scene, const SceneBlock& block) {
  FittedPoints points;
  points.origin = scene.origin;
  points.up = scene.up;
  std::vector<float>* const axes[3] = {&points.x, &points.y, &points.z};
  for (size_t axis = 0; axis < 3; ++axis) {
    axes[axis]->resize(block.count);
    const auto decode_axis = scene.position_format == PositionFormat::kFloat32 ? decode<float> : decode<uint16_t>;
    decode_axis(scene.positions, 3 * size_t(block.first) + axis * block.count, block.count, 1, &block.low[axis],
                &block.position_step[axis], axes[axis]->data());
  }
  points.constant_terms.resize(size_t(block.count) * kFeatures);
  points.linear_terms.resize(size_t(block.count) * kLinearTerms);
  const auto decode_terms = scene.coefficient_format == CoefficientFormat::kFloat32 ? decode<float>
                            : scene.coefficient_format == CoefficientFormat::kInt16 ? decode<int16_t>
                                                                                    : decode<int8_t>;
  decode_terms(scene.constant_terms, size_t(block.first) * kFeatures, block.count, kFeatures, block.constant_middle,
               block.constant_step, points.constant_terms.data());
  decode_terms(scene.linear_terms, size_t(block.first_view_dependent) * kLinearTerms, block.view_dependent,
               kLinearTerms, nullptr, block.linear_step, points.linear_terms.data());
  return points;
}

}  // namespace maq
