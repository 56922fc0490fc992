#include "prediction/codec/nearest_entry.h"

#include <algorithm>
#include <limits>

#include "core/simd_clones.h"

namespace maq {
namespace {

constexpr size_t kVector = 8, kLanes = 2 * kVector, kTogether = 4;  // entries and vectors that are compared at once
using Vector = float __attribute__((vector_size(4 * kVector)));
// In memory, wherever it lies.
using Stored = float __attribute__((vector_size(4 * kVector), aligned(4), may_alias));
using Blocks = int32_t __attribute__((vector_size(4 * kVector)));

// Takes kTogether vectors, `stride` floats apart. |v - e|^2 / 2 without the part that is equal for all entries: |e|^2 /
// 2 - v e.
MAQ_SIMD_CLONES void nearest_of_four(const float* vectors, size_t stride, size_t width, const float* entries,
                                     const float* half_squares, size_t blocks, uint16_t* found, size_t found_stride) {
  constexpr float kFar = std::numeric_limits<float>::infinity();
  Vector best[kTogether][2];
  Blocks best_block[kTogether][2] = {};
  for (auto& both : best) both[0] = both[1] = kFar - Vector{};
  for (size_t block = 0; block < blocks; ++block) {
    const auto* own = reinterpret_cast<const Stored*>(entries + block * width * kLanes);
    const auto* const squares = reinterpret_cast<const Stored*>(half_squares + block * kLanes);
    const Vector low = squares[0], high = squares[1];
    Vector d00 = low, d01 = high, d10 = low, d11 = high, d20 = low, d21 = high, d30 = low, d31 = high;
    for (size_t i = 0; i < width; ++i, own += 2) {
      const Vector e0 = own[0], e1 = own[1];
      const float* const v = vectors + i;
      const float v0 = v[0], v1 = v[stride], v2 = v[2 * stride], v3 = v[3 * stride];
      d00 -= v0 * e0, d01 -= v0 * e1;
      d10 -= v1 * e0, d11 -= v1 * e1;
      d20 -= v2 * e0, d21 -= v2 * e1;
      d30 -= v3 * e0, d31 -= v3 * e1;
    }
    const Vector distance[kTogether][2] = {{d00, d01}, {d10, d11}, {d20, d21}, {d30, d31}};
    for (size_t k = 0; k < kTogether; ++k) {
      for (size_t half = 0; half < 2; ++half) {
        const Blocks is_nearer = distance[k][half] < best[k][half];
        best[k][half] = is_nearer ? distance[k][half] : best[k][half];
        best_block[k][half] = is_nearer ? int32_t(block) - Blocks{} : best_block[k][half];
      }
    }
  }
  for (size_t k = 0; k < kTogether; ++k) {
    float nearest = kFar;
    size_t number = 0;
    for (size_t lane = 0; lane < kLanes; ++lane) {
      const size_t half = lane / kVector;
      const float distance = best[k][half][lane % kVector];
      const size_t of_lane = size_t(best_block[k][half][lane % kVector]) * kLanes + lane;
      if (distance < nearest || (distance == nearest && of_lane < number)) {
        nearest = distance;
        number = of_lane;
      }
    }
    found[k * found_stride] = nearest < kFar ? uint16_t(number) : uint16_t(0);
  }
}

}  // namespace

NearestEntry::NearestEntry(const FrameCodes& codes)
    : groups_(codes.groups),
      width_(codes.width),
      blocks_((codes.entries + kLanes - 1) / kLanes),
      entries_(groups_ * blocks_ * width_ * kLanes, 0.0f),
      half_squares_(groups_ * blocks_ * kLanes, std::numeric_limits<float>::infinity()) {
  for (size_t group = 0; group < groups_; ++group) {
    for (size_t entry = 0; entry < codes.entries; ++entry) {
      const float* const vector = codes.vectors.data() + (group * codes.entries + entry) * width_;
      const size_t block = group * blocks_ + entry / kLanes, lane = entry % kLanes;
      double square = 0;
      for (size_t i = 0; i < width_; ++i) {
        entries_[(block * width_ + i) * kLanes + lane] = vector[i];
        square += double(vector[i]) * double(vector[i]);
      }
      half_squares_[block * kLanes + lane] = float(square / 2);
    }
  }
}

void NearestEntry::run(const float* features, size_t cells, uint16_t* found) const {
  const size_t stride = groups_ * width_;
  for (size_t group = 0; group < groups_; ++group) {
    const float* const entries = entries_.data() + group * blocks_ * width_ * kLanes;
    const float* const half_squares = half_squares_.data() + group * blocks_ * kLanes;
    for (size_t first = 0; first < cells; first += kTogether) {
      // At the end some again; a single cell four times.
      const size_t from = std::min(first, cells - std::min(cells, kTogether));
      const bool is_one = cells == 1;
      nearest_of_four(features + from * stride + group * width_, is_one ? 0 : stride, width_, entries, half_squares,
                      blocks_, found + from * groups_ + group, is_one ? 0 : groups_);
    }
  }
}

}  // namespace maq
