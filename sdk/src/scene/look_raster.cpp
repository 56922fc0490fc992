#include "scene/look_raster.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/simd_clones.h"

namespace maq {
namespace {

// Neighbours in the picture may lie anywhere in memory, so that each point is asked for before its turn.
constexpr size_t kAhead = 16;
constexpr size_t kCacheLine = 64;
inline void fetch(const float* from, size_t bytes) {
  for (size_t offset = 0; offset < bytes; offset += kCacheLine) {
    __builtin_prefetch(reinterpret_cast<const char*>(from) + offset);
  }
}

// The look of a point: mean + h slope.
MAQ_SIMD_CLONES void look_from(const float* mean, const float* slope, const float h[kBasis], float look[kFeatures]) {
  for (int c = 0; c < kFeatures; ++c) look[c] = mean[c];
  for (int k = 0; k < kBasis; ++k) {
    for (int c = 0; c < kFeatures; ++c) look[c] += h[k] * slope[k * kFeatures + c];
  }
}

}  // namespace

void LookRaster::shade(const VisiblePoints& visible, const PointPlaces& points, const LookTable& looks,
                       const ViewBasis& basis, const PinholeCamera& camera) {
  const int width = visible.width_px(), height = visible.height_px();
  if (width % kMultiple != 0 || height % kMultiple != 0) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "A raster of ", width, " x ", height,
                " pixels cannot be halved four times; its sides must be multiples of ", kMultiple, ".");
  }
  const std::vector<uint32_t>& winners = visible.winners();
  pixels_.clear();
  for (uint32_t pixel = 0; pixel < winners.size(); ++pixel) {
    if (winners[pixel] != kNoPoint) pixels_.push_back(pixel);
  }

  const size_t count = pixels_.size();
  if (looks.slopes != nullptr) {
    directions_.resize(3 * count);
    float* const to[3] = {directions_.data(), directions_.data() + count, directions_.data() + 2 * count};
    const float* const from[3] = {points.x, points.y, points.z};
    for (size_t i = 0; i < count; ++i) {
      float away[3];
      for (size_t axis = 0; axis < 3; ++axis) {
        away[axis] = float(double(from[axis][winners[pixels_[i]]]) + (points.origin[axis] - camera.centre[axis]));
      }
      const float length = std::sqrt(away[0] * away[0] + away[1] * away[1] + away[2] * away[2]);
      for (size_t axis = 0; axis < 3; ++axis) to[axis][i] = length > 0 ? away[axis] / length : 0;
    }
    basis_values_.resize(kBasis * count);
    basis.evaluate(to[0], to[1], to[2], count, basis_values_.data());
  }

  for (int level = 0; level < kLevels; ++level) {
    levels_[level].assign(size_t(kChannels) * size_t(width >> level) * size_t(height >> level), 0.0f);
  }
  std::vector<float>& finest = levels_[0];
  const size_t plane = size_t(width) * size_t(height);
  for (size_t i = 0; i < count; ++i) {
    if (i + kAhead < count) {
      const size_t later = winners[pixels_[i + kAhead]];
      fetch(looks.means + later * kFeatures, kFeatures * sizeof(float));
      if (looks.slopes != nullptr) fetch(looks.slopes + later * kBasis * kFeatures, kBasis * kFeatures * sizeof(float));
    }
    const size_t point = winners[pixels_[i]];
    const float* mean = looks.means + point * kFeatures;
    float look[kFeatures], h[kBasis];
    if (looks.slopes != nullptr) {
      for (int k = 0; k < kBasis; ++k) h[k] = basis_values_[size_t(k) * count + i];
      look_from(mean, looks.slopes + point * kBasis * kFeatures, h, look);
    } else {
      std::copy_n(mean, kFeatures, look);
    }
    float* to = finest.data() + pixels_[i];
    for (int c = 0; c < kFeatures; ++c) to[size_t(c) * plane] = look[c];
    to[size_t(kFeatures) * plane] = 1;
  }

  // For each coarse pixel, the finest pixel of its nearest point.
  std::vector<uint32_t> before(winners.size()), nearest;
  for (uint32_t pixel = 0; pixel < before.size(); ++pixel) before[pixel] = pixel;
  const auto is_nearer = [&](uint32_t a, uint32_t b) {
    const float da = visible.depths()[a], db = visible.depths()[b];  // infinite where there is no point
    return da < db || (da == db && winners[a] < winners[b]);
  };
  for (int level = 1; level < kLevels; ++level) {
    const int w = width >> level, h = height >> level;
    nearest.resize(size_t(w) * size_t(h));
    for (int y = 0; y < h; ++y) {
      for (int x = 0; x < w; ++x) {
        const uint32_t* first = before.data() + (size_t(2 * y) * size_t(2 * w) + size_t(2 * x));
        uint32_t best = first[0];
        for (const uint32_t other : {first[1], first[2 * w], first[2 * w + 1]}) {
          if (is_nearer(other, best)) best = other;
        }
        const size_t at = size_t(y) * size_t(w) + size_t(x);
        nearest[at] = best;
        if (winners[best] == kNoPoint) continue;
        float* to = levels_[level].data() + at;
        for (int c = 0; c < kChannels; ++c) to[size_t(c) * size_t(w) * size_t(h)] = finest[size_t(c) * plane + best];
      }
    }
    before.swap(nearest);
  }
}

}  // namespace maq
