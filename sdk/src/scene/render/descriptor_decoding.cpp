#include "scene/render/descriptor_decoding.h"

#include <cmath>
#include <type_traits>

#include "core/simd_clones.h"
#include "scene/visibility/point_projection.h"

namespace maq {
namespace {

// From the first to the last byte, at most a cache line between two requests.
inline void prefetch_bytes(const char* from, size_t bytes) {
  constexpr size_t kCacheLine = 64;
  for (size_t offset = 0; offset < bytes; offset += kCacheLine) __builtin_prefetch(from + offset);
  __builtin_prefetch(from + bytes - 1);
}

template <class Stored>
inline void decode_all(const Scene& scene, const PointToShade* points, size_t count, const float* basis) {
  for (size_t i = 0; i < count; ++i) {
    const SceneBlock& block = scene.blocks[points[i].block];
    const Stored* constant =
        static_cast<const Stored*>(scene.constant_terms) + (block.first + points[i].point) * size_t(kFeatures);
    float descriptor[kFeatures];
    for (int c = 0; c < kFeatures; ++c) {
      if constexpr (std::is_same_v<Stored, float>) {
        descriptor[c] = constant[c];
      } else {
        descriptor[c] = block.constant_middle[c] + float(constant[c]) * block.constant_step[c];
      }
    }
    if (basis != nullptr) {
      const Stored* linear = static_cast<const Stored*>(scene.linear_terms) +
                             (block.first_view_dependent + points[i].point) * kLinearTerms;
      for (size_t k = 0; k < size_t(kBasis); ++k) {
        const float h = basis[k * count + i];
        for (size_t c = 0; c < size_t(kFeatures); ++c) {
          const size_t at = k * kFeatures + c;
          if constexpr (std::is_same_v<Stored, float>) {
            descriptor[c] += h * linear[at];
          } else {
            descriptor[c] += h * (float(linear[at]) * block.linear_step[at]);
          }
        }
      }
    }
    float* to = points[i].to;
    for (int c = 0; c < kFeatures; ++c) to[c] = descriptor[c];
    to[kFeatures] = 1;
  }
}

MAQ_SIMD_CLONES void decode_floats(const Scene& scene, const PointToShade* points, size_t count, const float* basis) {
  decode_all<float>(scene, points, count, basis);
}
MAQ_SIMD_CLONES void decode_int16(const Scene& scene, const PointToShade* points, size_t count, const float* basis) {
  decode_all<int16_t>(scene, points, count, basis);
}
MAQ_SIMD_CLONES void decode_int8(const Scene& scene, const PointToShade* points, size_t count, const float* basis) {
  decode_all<int8_t>(scene, points, count, basis);
}

MAQ_SIMD_CLONES void make_unit(float* __restrict x, float* __restrict y, float* __restrict z, size_t count) {
  for (size_t i = 0; i < count; ++i) {
    const float length = std::sqrt(x[i] * x[i] + y[i] * y[i] + z[i] * z[i]);
    const float scale = length > 0 ? 1 / length : 0;
    x[i] *= scale;
    y[i] *= scale;
    z[i] *= scale;
  }
}

template <class Stored>
void find_offsets(const Scene& scene, const std::array<double, 3>& centre, const PointToShade* points, size_t count,
                  float* x, float* y, float* z) {
  for (size_t i = 0; i < count; ++i) {
    float away[3];
    span_of(scene, scene.blocks[points[i].block], centre).offset<Stored>(points[i].point, away);
    x[i] = away[0];
    y[i] = away[1];
    z[i] = away[2];
  }
}

}  // namespace

void prefetch(const Scene& scene, const PointToShade* points, size_t count, bool with_linear_terms) {
  const size_t coordinate = size_bytes_of(scene.position_format);
  const size_t coefficient = size_bytes_of(scene.coefficient_format);
  const char* const positions = static_cast<const char*>(scene.positions);
  const char* const constant_terms = static_cast<const char*>(scene.constant_terms);
  const char* const linear_terms = static_cast<const char*>(scene.linear_terms);
  for (size_t i = 0; i < count; ++i) {
    const SceneBlock& block = scene.blocks[points[i].block];
    const size_t point = block.first + points[i].point;
    prefetch_bytes(constant_terms + point * kFeatures * coefficient, kFeatures * coefficient);
    if (!with_linear_terms) continue;
    for (size_t axis = 0; axis < 3; ++axis) {
      __builtin_prefetch(positions + (3 * size_t(block.first) + axis * block.count + points[i].point) * coordinate);
    }
    prefetch_bytes(linear_terms + (block.first_view_dependent + points[i].point) * kLinearTerms * coefficient,
                   kLinearTerms * coefficient);
  }
}

void find_directions(const Scene& scene, const std::array<double, 3>& camera_centre, const PointToShade* points,
                     size_t count, float* x, float* y, float* z) {
  if (scene.position_format == PositionFormat::kFloat32) {
    find_offsets<float>(scene, camera_centre, points, count, x, y, z);
  } else {
    find_offsets<uint16_t>(scene, camera_centre, points, count, x, y, z);
  }
  make_unit(x, y, z, count);
}

void decode_descriptors(const Scene& scene, const PointToShade* points, size_t count, const float* basis) {
  switch (scene.coefficient_format) {
    case CoefficientFormat::kFloat32: return decode_floats(scene, points, count, basis);
    case CoefficientFormat::kInt16: return decode_int16(scene, points, count, basis);
    case CoefficientFormat::kInt8: return decode_int8(scene, points, count, basis);
  }
}

}  // namespace maq
