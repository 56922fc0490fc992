#include "scene/splats/tile_blending.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "core/simd_clones.h"

namespace maq {
namespace {

constexpr int kGroup = 8;                           // pixels of a row that are computed together
constexpr int kRowGroups = kTileWidth_px / kGroup;  // of a row
constexpr int kTileGroups = kTileHeight_px * kRowGroups;
constexpr float kOpaque = 1.0f / 1024;  // transmittance of pixels that show nothing behind
constexpr float kMaxWeight = 0.99f;     // of a splat at a pixel, as the programs that train splats have it
constexpr float kExponentOf1 = 127;     // what floats add to an exponent
constexpr float kNothing = 40;          // an exponent, so enlarged, of weights that change no sum
constexpr float kWeightless = kExponentOf1 - kMaxFalloff;
constexpr int kSplatsBetweenChecks = 24;

// 2^(x - 127) for x from 1 to 127 within 1e-4 of its value: the whole part in the exponent, a polynomial for the rest.
inline float weight_of(float x) {
  const int32_t whole = int32_t(x);
  const float rest = x - float(whole);
  const float power = 1.0f + rest * (0.69583356f + rest * (0.22606716f + rest * 0.07809929f));
  const int32_t bits = whole << 23;
  float scale;
  std::memcpy(&scale, &bits, sizeof scale);
  return power * scale;
}

// Adds a splat to a group of pixels. `first`: the first pixel's place from the splat's middle in this row; `peak`: the
// exponent there, enlarged.
inline void blend_group(float first, float peak, const ProjectedSplat& splat, float* __restrict transmittance,
                        float* __restrict red, float* __restrict green, float* __restrict blue,
                        float* __restrict depth) {
  const float r = splat.rgb[0], g = splat.rgb[1], b = splat.rgb[2], z = splat.depth, curvature = splat.curvature;
  for (int i = 0; i < kGroup; ++i) {
    const float dx = first + float(i);
    const float exponent = peak - curvature * dx * dx;
    const float weight = weight_of(exponent >= kWeightless ? exponent : kNothing);
    const float added = transmittance[i] * (weight < kMaxWeight ? weight : kMaxWeight);
    transmittance[i] -= added;
    red[i] += added * r;
    green[i] += added * g;
    blue[i] += added * b;
    depth[i] += added * z;
  }
}

// Marks the groups of which a pixel shows what is behind. False: none is left.
inline bool find_open(const TileSums& sums, uint8_t* __restrict is_open) {
  bool any = false;
  for (int group = 0; group < kTileGroups; ++group) {
    if (is_open[group] == 0) continue;
    float most = 0;
    for (int i = 0; i < kGroup; ++i) most = std::max(most, sums.transmittance[group * kGroup + i]);
    is_open[group] = most > kOpaque ? 1 : 0;
    any |= is_open[group] != 0;
  }
  return any;
}

// For each row of the tile: the middle of the splat, the exponent there, and the pixels that it reaches.
struct TileRows {
  float middle[kTileHeight_px], peak[kTileHeight_px];
  int32_t first[kTileHeight_px], last[kTileHeight_px];  // groups; none where the last is before the first
};

inline void find_rows(const ProjectedSplat& splat, float left, float top, TileRows& rows) {
  const float x = splat.x - left, y = splat.y - top, per_curvature = 1 / splat.curvature;
  const float falloff = splat.falloff, slope = splat.slope, log_opacity = splat.log_opacity;
  constexpr float kEnd = float(kTileWidth_px);
  for (int row = 0; row < kTileHeight_px; ++row) {
    const float dy = float(row) - y;
    const float peak = log_opacity - falloff * dy * dy;
    const float budget = peak + kMaxFalloff;
    const float half_width = std::sqrt((budget > 0 ? budget : 0.0f) * per_curvature);
    const float middle = x - slope * dy;
    const float from = middle - half_width, to = middle + half_width;
    // The pixel before the first one is taken along: rounding up costs more. `last` must not round up to kEnd.
    const float first = from > 0 ? (from < kEnd ? from : kEnd) : 0.0f;
    const float last = to > -1 ? (to < kEnd - 1 ? to : kEnd - 1) : -1.0f;
    rows.middle[row] = middle;
    rows.peak[row] = peak + kExponentOf1;
    rows.first[row] = int32_t(first) / kGroup;
    rows.last[row] = budget > 0 ? (int32_t(last + 8) / kGroup) - 1 : -1;
  }
}

MAQ_SIMD_CLONES uint32_t blend(const ProjectedSplat* splats, const uint32_t* begin, const uint32_t* end, float left,
                               float top, TileSums& sums) {
  uint8_t is_open[kTileGroups];
  std::memset(is_open, 1, sizeof is_open);
  int until_check = kSplatsBetweenChecks;
  TileRows rows;
  for (const uint32_t* at = begin; at < end; ++at) {
    if (until_check-- == 0) {
      if (!find_open(sums, is_open)) return uint32_t(at - begin);
      until_check = kSplatsBetweenChecks;
    }
    if (end - at > 4) __builtin_prefetch(splats + at[4]);
    const ProjectedSplat& splat = splats[*at];
    find_rows(splat, left, top, rows);
    for (int row = 0; row < kTileHeight_px; ++row) {
      for (int group = rows.first[row]; group <= rows.last[row]; ++group) {
        const int place = row * kRowGroups + group;
        if (is_open[place] == 0) continue;
        const int pixel = place * kGroup;
        blend_group(float(group * kGroup) - rows.middle[row], rows.peak[row], splat, sums.transmittance + pixel,
                    sums.rgb[0] + pixel, sums.rgb[1] + pixel, sums.rgb[2] + pixel, sums.depth + pixel);
      }
    }
  }
  return uint32_t(end - begin);
}

// Sums over the pixels of a splat, for each place in a group: of the loss's change by the exponent, times x and y from
// the middle, and by the colours.
struct GradientSums {
  float e[kGroup], x[kGroup], xx[kGroup], y[kGroup], yx[kGroup], yy[kGroup], rgb[3][kGroup];
};

inline void group_gradients(float first, float dy, float peak, const ProjectedSplat& splat,
                            float* __restrict transmittance, float* __restrict behind, const float* __restrict red,
                            const float* __restrict green, const float* __restrict blue,
                            GradientSums& __restrict sums) {
  constexpr float kLn2 = 0.69314718f;
  const float r = splat.rgb[0], g = splat.rgb[1], b = splat.rgb[2], curvature = splat.curvature;
  for (int i = 0; i < kGroup; ++i) {
    const float dx = first + float(i);
    const float exponent = peak - curvature * dx * dx;
    const float full = weight_of(exponent >= kWeightless ? exponent : kNothing);
    const float weight = full < kMaxWeight ? full : kMaxWeight;
    const float added = transmittance[i] * weight, own = r * red[i] + g * green[i] + b * blue[i];
    behind[i] -= added * own;
    const float by_weight = transmittance[i] * own - behind[i] / (1 - weight);
    const float e = (full < kMaxWeight ? kLn2 : 0.0f) * weight * by_weight;
    transmittance[i] -= added;
    const float x = e * dx, y = e * dy;
    sums.e[i] += e;
    sums.x[i] += x;
    sums.xx[i] += x * dx;
    sums.y[i] += y;
    sums.yx[i] += y * dx;
    sums.yy[i] += y * dy;
    sums.rgb[0][i] += added * red[i];
    sums.rgb[1][i] += added * green[i];
    sums.rgb[2][i] += added * blue[i];
  }
}

inline float sum_of(const float* values) {
  float sum = 0;
  for (int i = 0; i < kGroup; ++i) sum += values[i];
  return sum;
}

MAQ_SIMD_CLONES void find_gradients(const ProjectedSplat* splats, const uint32_t* begin, const uint32_t* end,
                                    float left, float top, const float* loss, float* behind, TileSums& sums,
                                    SplatGradient* gradients) {
  uint8_t is_open[kTileGroups];
  std::memset(is_open, 1, sizeof is_open);
  int until_check = kSplatsBetweenChecks;
  TileRows rows;
  for (const uint32_t* at = begin; at < end; ++at, ++gradients) {
    if (until_check-- == 0) {
      if (!find_open(sums, is_open)) return;
      until_check = kSplatsBetweenChecks;
    }
    const ProjectedSplat& splat = splats[*at];
    find_rows(splat, left, top, rows);
    GradientSums of{};
    for (int row = 0; row < kTileHeight_px; ++row) {
      const float dy = float(row) + top - splat.y;
      for (int group = rows.first[row]; group <= rows.last[row]; ++group) {
        const int place = row * kRowGroups + group;
        if (is_open[place] == 0) continue;
        const int pixel = place * kGroup;
        group_gradients(float(group * kGroup) - rows.middle[row], dy, rows.peak[row], splat, sums.transmittance + pixel,
                        behind + pixel, loss + pixel, loss + kTilePixels + pixel, loss + 2 * kTilePixels + pixel, of);
      }
    }
    const float x = sum_of(of.x), y = sum_of(of.y), yx = sum_of(of.yx);
    gradients->log_opacity = sum_of(of.e);
    gradients->curvature = -sum_of(of.xx);
    gradients->slope = -2 * splat.curvature * yx;
    gradients->falloff = -sum_of(of.yy);
    gradients->x = 2 * splat.curvature * x;
    gradients->y = 2 * splat.curvature * splat.slope * x + 2 * splat.falloff * y;
    for (int c = 0; c < 3; ++c) gradients->rgb[c] = sum_of(of.rgb[c]);
  }
}

}  // namespace

void tile_gradients(const ProjectedSplat* splats, const uint32_t* begin, const uint32_t* end, int left_px, int top_px,
                    const float loss[3][kTilePixels], TileSums& sums, SplatGradient* gradients) {
  alignas(32) float behind[kTilePixels];
  for (int i = 0; i < kTilePixels; ++i) {
    behind[i] = loss[0][i] * sums.rgb[0][i] + loss[1][i] * sums.rgb[1][i] + loss[2][i] * sums.rgb[2][i];
  }
  std::fill_n(sums.transmittance, kTilePixels, 1.0f);
  std::fill_n(gradients, end - begin, SplatGradient{});
  find_gradients(splats, begin, end, float(left_px), float(top_px), loss[0], behind, sums, gradients);
}

uint32_t blend_tile(const ProjectedSplat* splats, const uint32_t* begin, const uint32_t* end, int left_px, int top_px,
                    TileSums& sums) {
  std::fill_n(sums.transmittance, kTilePixels, 1.0f);
  std::memset(sums.rgb, 0, sizeof sums.rgb);
  std::memset(sums.depth, 0, sizeof sums.depth);
  return blend(splats, begin, end, float(left_px), float(top_px), sums);
}

}  // namespace maq
