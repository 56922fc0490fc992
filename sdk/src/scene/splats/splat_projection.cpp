#include "scene/splats/splat_projection.h"

#include <algorithm>
#include <cmath>

#include "core/simd_clones.h"

namespace maq {
namespace {

// Variance that is added in pixels, as the programs that train splats do: no splat is thinner than a pixel.
constexpr float kPixelVariance = 0.3f;
// Beyond the image by this part of its size the projection is linearised as at this place; splats there would become
// needles.
constexpr double kLinearMargin = 0.15;
constexpr float kMinDepth = 1e-6f;
constexpr float kLog2E = 1.44269504f, kHalfLog2E = kLog2E / 2;
constexpr float kFarthestSplatPx = 1e6f;

// The splats of a chunk as ellipses, before those outside of the image are dropped.
struct ChunkProjection {
  float depth[kChunkSplats], x[kChunkSplats], y[kChunkSplats];
  float curvature[kChunkSplats], slope[kChunkSplats], falloff[kChunkSplats];
  float variance_x[kChunkSplats], variance_y[kChunkSplats];  // the first is negative for splats that are not seen
  float shrinkage[kChunkSplats];  // the area without the added variance, to that with it, squared
  float rgb[3][kChunkSplats];
};

// All places, since chunks have zeros behind their end: loops of a constant length are half the code.
inline void project_lanes(const SplatView::Parameters& given, const float* offset, const SplatChunk& chunk,
                          ChunkProjection& __restrict to) {
  const float* const px = chunk.position[0];
  const float* const py = chunk.position[1];
  const float* const pz = chunk.position[2];
  const float* const m0 = chunk.axes[0];
  const float* const m1 = chunk.axes[1];
  const float* const m2 = chunk.axes[2];
  const float* const m3 = chunk.axes[3];
  const float* const m4 = chunk.axes[4];
  const float* const m5 = chunk.axes[5];
  const float* const m6 = chunk.axes[6];
  const float* const m7 = chunk.axes[7];
  const float* const m8 = chunk.axes[8];
  const SplatView::Parameters by = given;  // no write below changes it
  const float* const r = by.rotation;
  for (int i = 0; i < kChunkSplats; ++i) {
    const float wx = offset[0] + px[i], wy = offset[1] + py[i], wz = offset[2] + pz[i];
    const float cx = r[0] * wx + r[1] * wy + r[2] * wz;
    const float cy = r[3] * wx + r[4] * wy + r[5] * wz;
    const float depth = r[6] * wx + r[7] * wy + r[8] * wz;
    // The axes in the camera: x, y and depth of the first, the second and the third.
    const float a0 = m0[i], a1 = m3[i], a2 = m6[i], b0 = m1[i], b1 = m4[i], b2 = m7[i], c0 = m2[i], c1 = m5[i],
                c2 = m8[i];
    const float axes[9] = {
        r[0] * a0 + r[1] * a1 + r[2] * a2, r[0] * b0 + r[1] * b1 + r[2] * b2, r[0] * c0 + r[1] * c1 + r[2] * c2,
        r[3] * a0 + r[4] * a1 + r[5] * a2, r[3] * b0 + r[4] * b1 + r[5] * b2, r[3] * c0 + r[4] * c1 + r[5] * c2,
        r[6] * a0 + r[7] * a1 + r[8] * a2, r[6] * b0 + r[7] * b1 + r[8] * b2, r[6] * c0 + r[7] * c1 + r[8] * c2};
    const float variance_along = axes[6] * axes[6] + axes[7] * axes[7] + axes[8] * axes[8];
    // The projection is not a linear one where the splat reaches the camera.
    const bool is_in_front = int(depth > by.near) & int(depth * depth > variance_along);
    const float inverse = 1 / (is_in_front ? depth : 1.0f);
    const float u = cx * inverse, v = cy * inverse;
    const float linear_u = std::min(std::max(u, by.low_u), by.high_u);
    const float linear_v = std::min(std::max(v, by.low_v), by.high_v);
    const float across = by.fx * inverse, down = by.fy * inverse;
    const float ax = across * (axes[0] - linear_u * axes[6]), ay = across * (axes[1] - linear_u * axes[7]),
                az = across * (axes[2] - linear_u * axes[8]);
    const float bx = down * (axes[3] - linear_v * axes[6]), by_ = down * (axes[4] - linear_v * axes[7]),
                bz = down * (axes[5] - linear_v * axes[8]);
    const float aa = ax * ax + ay * ay + az * az, bb = bx * bx + by_ * by_ + bz * bz, ab = ax * bx + ay * by_ + az * bz;
    // The determinant as sums of squares only.
    const float nx = ay * bz - az * by_, ny = az * bx - ax * bz, nz = ax * by_ - ay * bx;
    const float flat = nx * nx + ny * ny + nz * nz;
    const float determinant = flat + kPixelVariance * (aa + bb) + kPixelVariance * kPixelVariance;
    const float variance_x = aa + kPixelVariance, variance_y = bb + kPixelVariance;
    to.depth[i] = depth;
    to.x[i] = by.fx * u + by.cx;
    to.y[i] = by.fy * v + by.cy;
    to.curvature[i] = kHalfLog2E * variance_y / determinant;
    to.slope[i] = -ab / variance_y;
    to.falloff[i] = kHalfLog2E / variance_y;
    to.variance_x[i] = is_in_front ? variance_x : -1.0f;
    to.variance_y[i] = variance_y;
    to.shrinkage[i] = flat / determinant;
  }
}

MAQ_SIMD_CLONES void project_chunk(const SplatView::Parameters& by, const float* offset, const SplatChunk& chunk,
                                   ChunkProjection& to) {
  project_lanes(by, offset, chunk, to);
}

// Colours in the directions from the camera (the harmonics of Sloan 2008, with the signs of Kerbl et al.).
MAQ_SIMD_CLONES void shade_chunk(const float* offset, const SplatChunk& chunk, int degree, ChunkProjection& to) {
  for (int channel = 0; channel < 3; ++channel) {
    const float* const colour = chunk.colour[channel];
    float* const rgb = to.rgb[channel];
    for (int i = 0; i < kChunkSplats; ++i) rgb[i] = colour[i];
  }
  if (degree > 0) {
    float basis[kMaxShTerms][kChunkSplats];
    const float* const px = chunk.position[0];
    const float* const py = chunk.position[1];
    const float* const pz = chunk.position[2];
    float inverse_length[kChunkSplats];
    for (int i = 0; i < kChunkSplats; ++i) {
      const float x = offset[0] + px[i], y = offset[1] + py[i], z = offset[2] + pz[i];
      inverse_length[i] = 1 / std::sqrt(std::max(x * x + y * y + z * z, 1e-30f));
    }
    for (int i = 0; i < kChunkSplats; ++i) {
      float x = offset[0] + px[i], y = offset[1] + py[i], z = offset[2] + pz[i];
      const float inverse = inverse_length[i];
      x *= inverse, y *= inverse, z *= inverse;
      const float xx = x * x, yy = y * y, zz = z * z;
      basis[0][i] = -0.48860252f * y;
      basis[1][i] = 0.48860252f * z;
      basis[2][i] = -0.48860252f * x;
      basis[3][i] = 1.0925484f * x * y;
      basis[4][i] = -1.0925484f * y * z;
      basis[5][i] = 0.31539157f * (2 * zz - xx - yy);
      basis[6][i] = -1.0925484f * x * z;
      basis[7][i] = 0.54627422f * (xx - yy);
      basis[8][i] = -0.59004359f * y * (3 * xx - yy);
      basis[9][i] = 2.8906114f * x * y * z;
      basis[10][i] = -0.45704580f * y * (4 * zz - xx - yy);
      basis[11][i] = 0.37317633f * z * (2 * zz - 3 * xx - 3 * yy);
      basis[12][i] = -0.45704580f * x * (4 * zz - xx - yy);
      basis[13][i] = 1.4453057f * z * (xx - yy);
      basis[14][i] = -0.59004359f * x * (xx - 3 * yy);
    }
    const int terms = sh_terms(degree);
    for (int term = 0; term < terms; ++term) {
      for (int channel = 0; channel < 3; ++channel) {
        const int16_t* const sh = chunk.sh + (3 * term + channel) * kChunkSplats;
        const float* const along = basis[term];
        float* const rgb = to.rgb[channel];
        for (int i = 0; i < kChunkSplats; ++i) rgb[i] += along[i] * (kShStep * float(sh[i]));
      }
    }
  }
}

}  // namespace

SplatView::SplatView(const PinholeCamera& camera, double near, bool is_antialiased)
    : centre_(camera.centre), width_px_(camera.width_px), height_px_(camera.height_px) {
  for (size_t i = 0; i < 9; ++i) by_.rotation[i] = float(camera.rotation[i]);
  by_.fx = float(camera.fx_px);
  by_.fy = float(camera.fy_px);
  by_.cx = float(camera.cx_px);
  by_.cy = float(camera.cy_px);
  const double margin_x = kLinearMargin * camera.width_px, margin_y = kLinearMargin * camera.height_px;
  const double low_u = (-0.5 - margin_x - camera.cx_px) / camera.fx_px,
               high_u = (camera.width_px - 0.5 + margin_x - camera.cx_px) / camera.fx_px,
               low_v = (-0.5 - margin_y - camera.cy_px) / camera.fy_px,
               high_v = (camera.height_px - 0.5 + margin_y - camera.cy_px) / camera.fy_px;
  by_.low_u = float(low_u);
  by_.high_u = float(high_u);
  by_.low_v = float(low_v);
  by_.high_v = float(high_v);
  by_.near = std::max(float(near), kMinDepth);
  by_.width = float(camera.width_px);
  by_.height = float(camera.height_px);
  by_.is_antialiased = is_antialiased;
  const auto side = [](double across, double down, double forward) {
    const double length = std::sqrt(across * across + down * down + forward * forward);
    return std::array<double, 3>{across / length, down / length, forward / length};
  };
  sides_ = {side(1, 0, -low_u), side(-1, 0, high_u), side(0, 1, -low_v), side(0, -1, high_v)};
}

bool SplatView::may_show(const SplatChunk& chunk) const {
  double world[3], at[3] = {};
  for (size_t i = 0; i < 3; ++i) world[i] = chunk.centre[i] - centre_[i];
  for (size_t row = 0; row < 3; ++row) {
    for (size_t i = 0; i < 3; ++i) at[row] += double(by_.rotation[3 * row + i]) * world[i];
  }
  const double radius = double(chunk.radius) * 1.001;
  if (at[2] + radius < double(by_.near)) return false;
  return std::all_of(sides_.begin(), sides_.end(), [&](const std::array<double, 3>& side) {
    return side[0] * at[0] + side[1] * at[1] + side[2] * at[2] > -radius;
  });
}

int SplatView::project(const SplatChunk& chunk, int sh_degree, ProjectedSplat* projected, uint8_t* places) const {
  ChunkProjection to;
  float offset[3];
  for (size_t i = 0; i < 3; ++i) offset[i] = float(chunk.centre[i] - centre_[i]);
  const int count = int(chunk.count);
  project_chunk(by_, offset, chunk, to);
  uint16_t seen[kChunkSplats];
  int seen_count = 0;
  for (int i = 0; i < count; ++i) {
    if (!(to.variance_x[i] > 0)) continue;
    float log_opacity = kLog2E * chunk.log_opacity[i];
    // A splat that the added variance makes larger becomes fainter, if splats were trained so.
    if (by_.is_antialiased) log_opacity += 0.5f * std::log2(std::max(to.shrinkage[i], 1e-12f));
    const float reach = (log_opacity + kMaxFalloff) / kHalfLog2E;
    if (!(reach > 0)) continue;
    const float half_width = std::sqrt(reach * to.variance_x[i]), half_height = std::sqrt(reach * to.variance_y[i]);
    // Pixels whose centres lie within; comparisons with values that are not numbers are false.
    const float left = std::max(std::ceil(to.x[i] - half_width), 0.0f),
                right = std::min(std::floor(to.x[i] + half_width), by_.width - 1),
                top = std::max(std::ceil(to.y[i] - half_height), 0.0f),
                bottom = std::min(std::floor(to.y[i] + half_height), by_.height - 1);
    const bool is_seen = left <= right && top <= bottom && half_width < kFarthestSplatPx &&
                         half_height < kFarthestSplatPx && to.curvature[i] > 0 &&
                         std::abs(to.slope[i]) < kFarthestSplatPx && std::abs(to.x[i]) < kFarthestSplatPx &&
                         std::abs(to.y[i]) < kFarthestSplatPx;
    if (!is_seen) continue;
    ProjectedSplat& splat = projected[seen_count];
    splat = {to.x[i],
             to.y[i],
             to.curvature[i],
             to.slope[i],
             to.falloff[i],
             log_opacity,
             {},
             to.depth[i],
             {uint16_t(int(left) / kTileWidth_px), uint16_t(int(top) / kTileHeight_px),
              uint16_t(int(right) / kTileWidth_px + 1), uint16_t(int(bottom) / kTileHeight_px + 1)}};
    if (places != nullptr) places[seen_count] = uint8_t(i);
    seen[seen_count++] = uint16_t(i);
  }
  if (seen_count == 0) return 0;
  shade_chunk(offset, chunk, sh_degree, to);
  for (int k = 0; k < seen_count; ++k) {
    for (int channel = 0; channel < 3; ++channel) projected[k].rgb[channel] = std::max(to.rgb[channel][seen[k]], 0.0f);
  }
  return seen_count;
}

}  // namespace maq
