#include "scene/render/descriptor_decoding.h"

#include <cmath>
#include <type_traits>

#include "core/simd_clones.h"
#include "scene/visibility/point_projection.h"

namespace maq {
namespace {

constexpr size_t kSlopes = size_t(kBasis) * kFeatures;

size_t bytes_of(Coefficients kind) {
  return kind == Coefficients::kFloat32 ? sizeof(float) : kind == Coefficients::kInt16 ? sizeof(int16_t) : 1;
}

// From the first to the last byte, at most a cache line between two requests.
inline void fetch_bytes(const char* from, size_t bytes) {
  constexpr size_t kCacheLine = 64;
  for (size_t offset = 0; offset < bytes; offset += kCacheLine) __builtin_prefetch(from + offset);
  __builtin_prefetch(from + bytes - 1);
}

template <class Stored>
inline void decode_all(const Scene& scene, const PointToShade* points, size_t count, const float* basis) {
  for (size_t i = 0; i < count; ++i) {
    const SceneBlock& block = scene.blocks[points[i].block];
    const Stored* mean = static_cast<const Stored*>(scene.means) + (block.first + points[i].point) * size_t(kFeatures);
    float look[kFeatures];
    for (int c = 0; c < kFeatures; ++c) {
      if constexpr (std::is_same_v<Stored, float>) {
        look[c] = mean[c];
      } else {
        look[c] = block.mean_middle[c] + float(mean[c]) * block.mean_step[c];
      }
    }
    if (basis != nullptr) {
      const Stored* slope =
          static_cast<const Stored*>(scene.slopes) + (block.first_varying + points[i].point) * kSlopes;
      for (size_t k = 0; k < size_t(kBasis); ++k) {
        const float h = basis[k * count + i];
        for (size_t c = 0; c < size_t(kFeatures); ++c) {
          const size_t at = k * kFeatures + c;
          if constexpr (std::is_same_v<Stored, float>) {
            look[c] += h * slope[at];
          } else {
            look[c] += h * (float(slope[at]) * block.slope_step[at]);
          }
        }
      }
    }
    float* to = points[i].to;
    for (int c = 0; c < kFeatures; ++c) to[c] = look[c];
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

void fetch(const Scene& scene, const PointToShade* points, size_t count, bool with_slopes) {
  const size_t place = scene.place_kind == Places::kFloat32 ? sizeof(float) : sizeof(uint16_t);
  const size_t coefficient = bytes_of(scene.coefficient_kind);
  const char* const places = static_cast<const char*>(scene.places);
  const char* const means = static_cast<const char*>(scene.means);
  const char* const slopes = static_cast<const char*>(scene.slopes);
  for (size_t i = 0; i < count; ++i) {
    const SceneBlock& block = scene.blocks[points[i].block];
    const size_t point = block.first + points[i].point;
    fetch_bytes(means + point * kFeatures * coefficient, kFeatures * coefficient);
    if (!with_slopes) continue;
    for (size_t axis = 0; axis < 3; ++axis) {
      __builtin_prefetch(places + (3 * size_t(block.first) + axis * block.count + points[i].point) * place);
    }
    fetch_bytes(slopes + (block.first_varying + points[i].point) * kSlopes * coefficient, kSlopes * coefficient);
  }
}

void find_directions(const Scene& scene, const std::array<double, 3>& camera_centre, const PointToShade* points,
                     size_t count, float* x, float* y, float* z) {
  if (scene.place_kind == Places::kFloat32) {
    find_offsets<float>(scene, camera_centre, points, count, x, y, z);
  } else {
    find_offsets<uint16_t>(scene, camera_centre, points, count, x, y, z);
  }
  make_unit(x, y, z, count);
}

void decode_looks(const Scene& scene, const PointToShade* points, size_t count, const float* basis) {
  switch (scene.coefficient_kind) {
    case Coefficients::kFloat32: return decode_floats(scene, points, count, basis);
    case Coefficients::kInt16: return decode_int16(scene, points, count, basis);
    case Coefficients::kInt8: return decode_int8(scene, points, count, basis);
  }
}

}  // namespace maq
